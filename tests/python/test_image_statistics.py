# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Image statistics: the geometry that matches are judged by, on made-up views."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

import contact_sheet
import image_statistics
from image_check.frames import FOCAL_PX, HEIGHT_PX, WIDTH_PX, Camera, Floats, Frame, Undistorter
from image_check.matching import Features, Models, found_agreement, mutual, true_agreement
from image_statistics import medians, nearest, neighbours, outside, shares, spread, table

NO_IMAGE = np.zeros((1, 1), np.float32)


def frame(rotation: Rotation, position: list[float]) -> Frame:
    return Frame(0.0, NO_IMAGE, rotation, np.array(position))


def views(a: Frame, b: Frame, count: int, seed: int) -> tuple[Floats, Floats]:
    """Rays of points that both see, half a pixel off."""
    random = np.random.default_rng(seed)
    points = random.uniform([-8, -3, 6], [8, 3, 40], (count, 3))
    rays = []
    for view in (a, b):
        q = view.rotation.inv().apply(points - view.position_m)
        q = q / q[:, 2:]
        q[:, :2] += random.normal(size=(count, 2)) * 0.5 / FOCAL_PX
        rays.append(q)
    return rays[0], rays[1]


A = frame(Rotation.identity(), [0.0, 0.0, 0.0])
B = frame(Rotation.from_euler("y", 3.0, degrees=True), [0.2, 0.0, 1.2])


def test_right_matches_agree_with_the_true_poses_and_wrong_ones_seldom_do() -> None:
    rays_a, rays_b = views(A, B, 300, seed=1)
    assert true_agreement(A, B, rays_a, rays_b).mean() > 0.95
    shuffled = np.roll(rays_b, 7, axis=0)
    assert true_agreement(A, B, rays_a, shuffled).mean() < 0.1


def test_views_from_one_place_are_judged_by_the_rotation_alone() -> None:
    turned = frame(Rotation.from_euler("y", 5.0, degrees=True), [0.0, 0.0, 0.0])
    rays_a, rays_b = views(A, turned, 100, seed=2)
    assert true_agreement(A, turned, rays_a, rays_b).mean() > 0.95
    assert true_agreement(A, A, rays_a, rays_b).mean() < 0.05


def test_the_found_geometry_keeps_right_matches_among_wrong_ones() -> None:
    rays_a, rays_b = views(A, B, 300, seed=3)
    rays_b[200:] = np.roll(rays_b[200:], 13, axis=0)
    agree = found_agreement(rays_a, rays_b, seed=0)
    assert agree[:200].mean() > 0.85 and agree[200:].mean() < 0.2
    assert not found_agreement(rays_a[:10], rays_b[:10], seed=0).any()  # too few to tell


def test_the_undistorter_looks_where_the_lens_sends_the_ray() -> None:
    camera = {
        "intrinsics": [900.0, 910.0, 700.0, 260.0],
        "distortion_model": "radtan",
        "distortion_coeffs": [-0.3, 0.1, 0.001, -0.002],
        "resolution": [1400, 520],
    }
    undistorter = Undistorter(camera)
    u, v = 400, 230
    x, y = (u - 0.5 * (WIDTH_PX - 1)) / FOCAL_PX, (v - 0.5 * (HEIGHT_PX - 1)) / FOCAL_PX
    r2 = x * x + y * y
    radial = 1 - 0.3 * r2 + 0.1 * r2**2
    xd = x * radial + 2 * 0.001 * x * y - 0.002 * (r2 + 2 * x * x)
    yd = y * radial + 0.001 * (r2 + 2 * y * y) - 2 * 0.002 * x * y
    assert undistorter.columns[v, u] == pytest.approx(900.0 * xd + 700.0)
    assert undistorter.rows[v, u] == pytest.approx(910.0 * yd + 260.0)
    assert undistorter.shrink == 2 and undistorter.seen[v, u] and not undistorter.seen[0, 0]


def test_a_drive_that_differs_by_more_is_told() -> None:
    def result(share: float) -> dict[str, dict[str, float]]:
        row = {"repeated_share": share, "inlier_share": 0.8}
        return {"mutual": row, "network": row}

    assert outside([result(0.5), result(0.4)], 0.3) == []
    complaints = outside([result(0.5), result(0.3)], 0.3)
    assert len(complaints) == 2 and "repeated_share" in complaints[0]


def test_a_first_drive_without_pairs_or_matches_leaves_the_ratio_blank() -> None:
    found = {"keypoints": 9.0, "matched_share": 0.5, "inlier_share": 0.8, "repeated_share": 0.4}
    none = dict.fromkeys(found, 0.0)
    good = {"mutual": found, "network": found, "pairs": {"count": 7.0}}
    for first in ({}, none, {**found, "repeated_share": 0.0}):
        result = {"mutual": first, "network": first, "pairs": {"count": 0.0}}
        lines = table(["first", "second"], [result, good])
        assert "| 7 |" in lines[-1] and "repeated x" not in lines[-1]
        assert ("inliers x 1.00" in lines[-1]) == (first.get("inlier_share") == 0.8)


def drive_by(metres: list[float]) -> list[Camera]:
    return [(i, Rotation.identity(), np.array([x, 0.0, 0.0])) for i, x in enumerate(metres)]


def test_pairs_are_of_distinct_places_however_long_the_vehicle_stands() -> None:
    query = drive_by([0.0] * 50 + [1.0, 2.0, 3.0] + [3.01] * 50 + [4.0, 20.0])
    nodes = drive_by([0.4, 1.4, 2.4, 3.4, 4.4])
    assert nearest(query, nodes, 1.0) == [(0, 0), (50, 1), (51, 2), (52, 3), (103, 4)]
    assert nearest(query, [], 1.0) == []
    assert [i for i, _ in neighbours(query, 1.0)] == [0, 50, 51, 52, 103]
    assert spread([(i, i) for i in range(100)], 3) == [(0, 0), (49, 49), (99, 99)]


@pytest.mark.parametrize("options", [["none"], ["--across", "none", "none"]])
def test_a_missing_drive_or_model_is_one_line(
    options: list[str], models: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    for folder, missing in ((models, "none/vehicle.yaml"), (tmp_path, "xfeat_")):
        words = ["image_statistics.py", *options, "--models", str(folder)]
        monkeypatch.setattr(sys, "argv", words)
        assert image_statistics.main() == 1
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and missing in said


def test_rows_of_a_contact_sheet_are_drives_of_their_own(tmp_path: Path) -> None:
    options = [strip.options(tmp_path, 7) for strip in contact_sheet.STRIPS]
    town = [o[o.index("--seed") + 1] for o in options if "highway" not in o and "tunnel" not in o]
    assert len(town) == 4 == len(set(town))


@pytest.mark.parametrize(
    ("program", "said"), [("#!/bin/false\n", "topoloc-simulate failed"), ("", "topoloc-simulate")]
)
def test_a_contact_sheet_without_its_simulation_is_one_line(
    program: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    if program:
        simulator = tmp_path / "topoloc-simulate"
        simulator.write_text(program)
        simulator.chmod(0o755)
    words = ["contact_sheet.py", "--bins", str(tmp_path), "--work", str(tmp_path / "work")]
    monkeypatch.setattr(sys, "argv", words)
    assert contact_sheet.main() == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and said in error


def test_shares_and_medians() -> None:
    features = Features(np.zeros((100, 2)), np.zeros((100, 64), np.float32))
    pairs = np.column_stack([np.arange(50), np.arange(50)])
    row = shares(features, pairs, np.arange(50) < 40)
    assert row["matched_share"] == 0.5 and row["inlier_share"] == 0.8
    assert row["repeated_share"] == 0.4
    assert medians([row, row, {**row, "matches": 900.0}])["matches"] == 50.0


def test_the_models_match_an_image_with_itself(models: Path) -> None:
    random = np.random.default_rng(4)
    noise = gaussian_filter(random.normal(size=(HEIGHT_PX, WIDTH_PX)), 2.0)
    image = (128 + 100 * np.sign(noise)).astype(np.float32)  # blobs
    networks = Models(models)
    features = networks.extract(image, np.ones(image.shape, bool))
    assert len(features.pixels) > 300
    for pairs in (mutual(features, features), networks.network(features, features)):
        assert len(pairs) > 0.9 * len(features.pixels)
        assert (pairs[:, 0] == pairs[:, 1]).all()

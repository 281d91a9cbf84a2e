# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Image statistics: the geometry that matches are judged by, on made-up views."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from image_check.frames import FOCAL_PX, HEIGHT_PX, WIDTH_PX, Floats, Frame, Undistorter
from image_check.matching import Features, Models, found_agreement, mutual, true_agreement
from image_statistics import medians, outside, shares

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

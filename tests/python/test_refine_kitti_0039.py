# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Node poses found in a real cloud: a stretch of KITTI 2011_09_26_drive_0039 from a trajectory that
is disturbed by 0.3 m and 1 degree per axis, and what the builder says of input that cannot fit.
The whole drive: tools/node_pose_table.py."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from programs import run

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import node_pose_table  # noqa: E402

DATA = Path(os.environ.get("TOPOLOC_DATA", ROOT / ".." / "shared" / "data")) / "kitti_0039"
BINS = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build" / "release" / "bin"))
FROM_M, TO_M = 20.0, 120.0

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"{DATA} is not there")


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory, kitti_0039: Path) -> node_pose_table.Table:
    work = tmp_path_factory.mktemp("refine_0039")
    return node_pose_table.Table(kitti_0039, DATA / "cloud.laz", work / "table", BINS)


def stretch(table: node_pose_table.Table, to_m: float) -> Path:
    """A part of the disturbed trajectory."""
    truth = table.truth
    whole = truth.disturbed("slow", 7, table.work / "whole.tum").read_text().splitlines()
    steps_m = np.linalg.norm(np.diff(truth.positions, axis=0), axis=1)
    way_m = np.concatenate([[0.0], np.cumsum(steps_m)])
    part = table.work / f"stretch_{to_m:.0f}.tum"
    kept = [line for line, m in zip(whole, way_m, strict=True) if FROM_M <= m <= to_m]
    part.write_text("\n".join(kept) + "\n")
    return part


def build(
    drive: Path, cloud: Path, trajectory: Path, out: Path
) -> subprocess.CompletedProcess[str]:
    """With its registrations beside the map."""
    command: list[str | Path] = [BINS / "topoloc-map", "build", "--drive", drive, "--cloud", cloud]
    command += ["--trajectory", trajectory, "--refine", "auto", "--out", out]
    return run(*command, "--registrations", out.with_suffix(".csv"))


def registrations(out: Path) -> list[dict[str, str]]:
    with out.with_suffix(".csv").open() as lines:
        return list(csv.DictReader(lines))


@pytest.fixture(scope="module")
def refined(table: node_pose_table.Table) -> dict[str, Any]:
    out = table.work / "refined.tmap"
    result = build(table.drive, table.cloud, stretch(table, TO_M), out)
    assert result.returncode == 0, result.stderr
    return table.compare(out)


def test_finds_the_poses_from_a_trajectory_wrong_by_decimetres(refined: dict[str, Any]) -> None:
    print(refined)
    assert refined["accepted"] >= 0.7
    assert refined["median_m"] <= 0.12
    assert refined["worst_m"] <= 0.6
    assert refined["median_deg"] <= 0.4


def test_errors_fit_the_covariances(refined: dict[str, Any]) -> None:
    assert 0.1 <= refined["normalised"] <= 2.5


def test_tells_every_registration(table: node_pose_table.Table, refined: dict[str, Any]) -> None:
    rows = registrations(table.work / "refined.tmap")
    for route, threshold in (("matches", 8.0), ("correlation", 5.5)):
        of_route = [row for row in rows if row["route"] == route]
        assert {row["pass"] for row in of_route} >= {"0"}
        for row in of_route:
            significant = float(row["significance"]) >= threshold
            assert significant == (row["significant"] == "1")
            assert significant or row["accepted"] == "0"
            assert 0.0 < float(row["std_x_m"]) < 5.0
            assert float(row["seconds"]) > 0.0
    windows = [r for r in rows if r["route"] == "correlation" and r["accepted"] == "1"]
    truth, _ = table.truth.at(np.array([int(row["time_ns"]) for row in windows]))
    found = np.array([[float(row[f"found_{axis}_m"]) for axis in "xyz"] for row in windows])
    assert np.median(np.linalg.norm(found - truth, axis=1)) < 0.2


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--refine", "correlation", "--pair-model", "x.onnx"], "--pair-model"),
        (["--refine", "none", "--registrations", "x.csv"], "--registrations"),
        (["--refine", "matches", "--pair-model", "x.onnx"], "x.onnx"),
        (["--refine", "sometimes"], "--refine"),
    ],
)
def test_names_options_that_do_not_fit(
    table: node_pose_table.Table, options: list[str], complaint: str
) -> None:
    (table.work / "x.onnx").write_text("not a network")
    here = [str(table.work / o) if o.startswith("x.") else o for o in options]
    trajectory = stretch(table, 60.0)
    out = table.work / "options.tmap"
    result = run(BINS / "topoloc-map", "build", "--drive", table.drive, "--cloud", table.cloud,
                 "--trajectory", trajectory, "--out", out, *here)  # fmt: skip
    assert result.returncode != 0
    assert complaint in result.stderr
    assert not out.exists()


def test_refuses_a_cloud_without_intensities(table: node_pose_table.Table) -> None:
    cloud = table.work / "plain.ply"
    head = "ply\nformat ascii 1.0\nelement vertex 4000\n"
    head += "property float x\nproperty float y\nproperty float z\nend_header\n"
    position = table.truth.positions[len(table.truth.positions) // 3]
    points = position + np.random.default_rng(1).uniform(-20.0, 20.0, (4000, 3))
    cloud.write_text(head + "\n".join(" ".join(f"{v:.3f}" for v in p) for p in points) + "\n")
    out = table.work / "plain.tmap"
    result = build(table.drive, cloud, stretch(table, 60.0), out)
    assert result.returncode == 1
    assert "intensities" in result.stderr
    assert not out.exists()


def test_refuses_a_camera_that_looks_the_other_way_up(table: node_pose_table.Table) -> None:
    """Extrinsics with two axes the wrong way round: images and cloud cannot agree."""
    drive = table.work / "upside_down"
    drive.mkdir()
    for item in table.drive.iterdir():
        if item.name != "camchain.yaml":
            (drive / item.name).symlink_to(item)
    lines = (table.drive / "camchain.yaml").read_text().splitlines()
    rows = [i for i, line in enumerate(lines) if line.strip().startswith("- [")]
    for i in rows[:2]:  # x and y of the camera
        numbers = [-float(v) for v in lines[i].split("[")[1].rstrip("] ").split(",")]
        lines[i] = f"  - [{', '.join(repr(v) for v in numbers)}]"
    (drive / "camchain.yaml").write_text("\n".join(lines) + "\n")
    out = table.work / "upside_down.tmap"
    result = build(drive, table.cloud, stretch(table, 60.0), out)
    assert result.returncode == 1
    assert "do not agree" in result.stderr
    assert not out.exists()
    # What was tried is told all the same.
    tried = registrations(out)
    assert len(tried) > 5
    assert sum(row["accepted"] == "1" for row in tried) < 0.6 * len(tried)

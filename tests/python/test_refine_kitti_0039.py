# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Node poses found in a real cloud: a stretch of KITTI 2011_09_26_drive_0039 from a trajectory that
is disturbed by 0.3 m and 1 degree per axis. The whole drive: tools/node_pose_table.py; input that
cannot fit: test_refine_bad_input.py."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from programs import run
from refine_0039 import BINS, DATA, build, registrations, stretch

from node_pose_table import Table

# Before, the cloud has two roads, 0.3 m one above the other: docs/node-poses.md.
FROM_M, TO_M = 50.0, 150.0

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"{DATA} is not there")


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory, kitti_0039: Path) -> Table:
    work = tmp_path_factory.mktemp("refine_0039")
    return Table(kitti_0039, DATA / "cloud.laz", work / "table", BINS)


@pytest.fixture(scope="module")
def summary(table: Table) -> str:
    """What the build said of refined.tmap."""
    out = table.work / "refined.tmap"
    result = build(table.drive, table.cloud, out, "--trajectory", stretch(table, FROM_M, TO_M))
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def refined(table: Table, summary: str) -> dict[str, Any]:
    return table.compare(table.work / "refined.tmap")


def test_the_summary_tells_which_frames_have_a_pose(summary: str) -> None:
    told = re.search(
        r"frames: (\d+) usable, 0 of the other parity, (\d+) without a pose: "
        r"poses are found for (\d+) keyframes",
        summary,
    )
    assert told, summary
    frames, without, keyframes = (int(n) for n in told.groups())
    assert without + keyframes == frames == 400
    assert 50 < keyframes < 120  # one a metre or a frame, on 100 m
    assert re.search(r"; poses: \d+\.\d s; nodes: ", summary)


def test_finds_the_poses_from_a_trajectory_wrong_by_decimetres(refined: dict[str, Any]) -> None:
    print(refined)
    assert refined["accepted"] >= 0.7
    assert refined["median_m"] <= 0.12
    assert refined["worst_m"] <= 0.6
    assert refined["median_deg"] <= 0.4


def test_errors_fit_the_covariances(refined: dict[str, Any]) -> None:
    assert 0.1 <= refined["normalised"] <= 2.5


def test_tells_every_registration(table: Table, refined: dict[str, Any]) -> None:
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
        (["--refine", "none", "--odometry", "wheel-imu"], "--odometry"),
        (["--refine", "matches", "--pair-model", "x.onnx"], "x.onnx"),
        (["--refine", "sometimes"], "--refine"),
    ],
)
def test_names_options_that_do_not_fit(table: Table, options: list[str], complaint: str) -> None:
    (table.work / "x.onnx").write_text("not a network")
    here = [str(table.work / o) if o.startswith("x.") else o for o in options]
    trajectory = stretch(table, 20.0, 60.0)
    out = table.work / "options.tmap"
    result = run(BINS / "topoloc-map", "build", "--drive", table.drive, "--cloud", table.cloud,
                 "--trajectory", trajectory, "--out", out, *here)  # fmt: skip
    assert result.returncode != 0
    assert complaint in result.stderr
    assert not out.exists()

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The main job on a real drive: KITTI 2011_09_26_drive_0039, map from the even frames, odd frames
localised in it, initial pose wrong by 1 m and 3 degrees, errors from 2 s on."""

from __future__ import annotations

import csv
import json
import os
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from programs import run

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import accuracy_table  # noqa: E402

DATA = Path(os.environ.get("TOPOLOC_DATA", ROOT / ".." / "shared" / "data")) / "kitti_0039"
BINS = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build" / "release" / "bin"))

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"{DATA} is not there")


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory, kitti_0039: Path) -> accuracy_table.Table:
    work = tmp_path_factory.mktemp("localise_0039")
    return accuracy_table.Table(
        kitti_0039, DATA / "cloud.laz", kitti_0039 / "ground_truth.tum", work / "table", BINS
    )


def row(label: str) -> accuracy_table.Row:
    return next(r for r in accuracy_table.ROWS if r.label.startswith(label))


@pytest.fixture(scope="module")
def default(table: accuracy_table.Table) -> dict[str, float]:
    return table.figures(row("default"))


def test_is_accurate_to_centimetres(default: dict[str, float]) -> None:
    assert default["apet_m"] <= 0.06
    assert default["aper_rad"] <= 0.004
    assert default["max_position_m"] <= 0.30
    assert abs(default["longitudinal_signed_m"]) <= 0.03
    assert abs(default["lateral_signed_m"]) <= 0.03
    assert default["coverage"] >= 0.99


def test_two_runs_give_the_same_bytes(
    table: accuracy_table.Table, default: dict[str, float]
) -> None:
    estimates = {p: p.read_bytes() for p in table.work.glob("est_*.tum")}
    table.figures(row("default"))
    assert estimates
    assert all(p.read_bytes() == content for p, content in estimates.items())


def test_bears_a_wheel_speed_wrong_by_two_percent(table: accuracy_table.Table) -> None:
    assert table.figures(row("speed scaled by 1.02"))["apet_m"] <= 0.10


@pytest.mark.parametrize(("late", "bound_m"), [("0.3", 0.07), ("0.8", 0.125)])
def test_bears_matches_that_come_late(
    table: accuracy_table.Table, late: str, bound_m: float
) -> None:
    """Within centimetres of what the drive's reference allows (docs/accuracy.md)."""
    assert table.figures(row(f"matches {late} s late"))["apet_m"] <= bound_m


def test_bears_nodes_20_m_apart(table: accuracy_table.Table) -> None:
    figures = table.figures(row("nodes 20 m"))
    assert figures["apet_m"] <= 0.20
    assert figures["coverage"] >= 0.99
    states = max(table.work.glob("est_*.states.csv"), key=lambda path: path.stat().st_mtime_ns)
    with states.open() as file:
        modes = Counter(line["mode"] for line in csv.DictReader(file))
    assert modes["lost"] == 0
    assert modes["tracking"] >= 0.9 * modes.total()


def test_wrong_camera_stamps_show_as_longitudinal_error(
    table: accuracy_table.Table, default: dict[str, float]
) -> None:
    """Frames stamped 50 ms late are taken for where the car was 50 ms before: the estimate lags by
    50 ms of way. The map comes from unshifted frames, so nothing cancels."""
    shifted = table.figures(row("camera stamps 50 ms late"))
    truth = accuracy_table.read_tum(table.reference)
    way = np.linalg.norm(np.diff(truth[:, 1:4], axis=0), axis=1).sum()
    expected = -0.05 * way / (truth[-1, 0] - truth[0, 0])
    measured = shifted["longitudinal_signed_m"] - default["longitudinal_signed_m"]
    assert measured == pytest.approx(expected, rel=0.2)


def test_baselines_are_at_least_three_times_worse(
    table: accuracy_table.Table, default: dict[str, float]
) -> None:
    assert table.figures(row("dead reckoning"))["apet_m"] >= 3 * default["apet_m"]
    assert table.nearest_node(row("default"))["apet_m"] >= 3 * default["apet_m"]


def test_check_tells_a_map_of_another_model(table: accuracy_table.Table) -> None:
    town = table.map_of(row("default"))
    other = table.variant(accuracy_table.Row("", matching={"max_features": 1024}), 0.0)
    command = (BINS / "topoloc-localise", "--check", "--json", "-", "--map", town)
    found = {}
    for name, folder in (("same", table.variant(row("default"), 0.0)), ("other", other)):
        checks = json.loads(run(*command, "--config", folder / "vehicle.yaml").stdout)
        found[name] = next(c for c in checks if c["what"] == "map and models")
    assert found["same"]["verdict"] == "ok", found["same"]
    assert found["other"]["verdict"] == "error"
    assert town.name in found["other"]["text"]
    assert "build the map again or configure its model" in found["other"]["text"]

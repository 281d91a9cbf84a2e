# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Maps of the accuracy table belong to one drive, one cloud and one builder."""

import os
from pathlib import Path

import pytest

import accuracy_table

BUILDER = """#!/bin/sh
while [ "$1" != --out ]; do shift; done
echo built >> "$2"
"""


@pytest.fixture
def sources(tmp_path: Path) -> Path:
    """Two drives, a cloud and a builder that only writes its output file."""
    for name in ("monday", "tuesday"):
        drive = tmp_path / name
        drive.mkdir()
        (drive / "vehicle.yaml").write_text("vehicle: {}\n")
        (drive / "camchain.yaml").write_text("cam0: {}\n")
        (drive / "can.log").write_text(name)
        (drive / "ground_truth.tum").touch()
    (tmp_path / "cloud.laz").touch()
    builder = tmp_path / "topoloc-map"
    builder.write_text(BUILDER)
    builder.chmod(0o755)
    for file in tmp_path.rglob("*"):
        os.utime(file, (1000.0, 1000.0))
    return tmp_path


def table(sources: Path, drive: str = "monday") -> accuracy_table.Table:
    return accuracy_table.Table(
        sources / drive,
        sources / "cloud.laz",
        sources / drive / "ground_truth.tum",
        sources / "work",
        sources,
    )


def test_map_is_kept_while_nothing_changes(sources: Path) -> None:
    first = table(sources).map_of(accuracy_table.ROWS[0])
    assert table(sources).map_of(accuracy_table.ROWS[0]) == first
    assert first.read_text() == "built\n"


@pytest.mark.parametrize(
    "changed", ["topoloc-map", "cloud.laz", "monday/can.log", "monday/ground_truth.tum"]
)
def test_map_is_built_again_when_a_source_has_changed(sources: Path, changed: str) -> None:
    first = table(sources).map_of(accuracy_table.ROWS[0])
    os.utime(sources / changed, (2000.0, 2000.0))
    assert table(sources).map_of(accuracy_table.ROWS[0]) != first


def test_another_drive_has_its_own_data_and_map(sources: Path) -> None:
    row = accuracy_table.ROWS[0]
    monday, tuesday = table(sources), table(sources, "tuesday")
    assert monday.map_of(row) != tuesday.map_of(row)
    assert (tuesday.variant(row, 0.0) / "can.log").read_text() == "tuesday"

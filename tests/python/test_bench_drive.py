# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Tests of tools/bench_drive.py: which drive the benches play."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench_drive import bench_drive


def drive_folder(path: Path) -> Path:
    path.mkdir(parents=True)
    for name in ("vehicle.yaml", "cloud.laz", "can.log"):
        (path / name).write_text(f"name: {name}\n")
    return path


def test_a_drive_folder_is_played_from_a_copy_of_its_settings(tmp_path: Path) -> None:
    given = drive_folder(tmp_path / "town")
    drive, cloud = bench_drive(given, tmp_path / "work", tmp_path)
    assert drive == tmp_path / "work/town" and cloud == given / "cloud.laz"
    assert (drive / "can.log").read_text() == "name: can.log\n"
    assert not (drive / "vehicle.yaml").is_symlink()


def test_a_drive_folder_among_the_benchs_own_is_played_as_it_is(tmp_path: Path) -> None:
    given = drive_folder(tmp_path / "work/town")
    assert bench_drive(given, tmp_path / "work", tmp_path) == (given, given / "cloud.laz")
    assert (given / "can.log").read_text() == "name: can.log\n"


def test_a_drive_folder_without_a_cloud_is_refused(tmp_path: Path) -> None:
    given = drive_folder(tmp_path / "town")
    (given / "cloud.laz").unlink()
    with pytest.raises(SystemExit, match=r"without cloud\.laz or cloud\.ply"):
        bench_drive(given, tmp_path / "work", tmp_path)

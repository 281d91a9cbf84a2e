# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""What the tests of refinement on KITTI 2011_09_26_drive_0039 share: parts of the drive whose
trajectory is disturbed by 0.3 m and 1 degree per axis, and maps built of them."""

from __future__ import annotations

import csv
import os
import subprocess
from pathlib import Path

from programs import run

from node_pose_table import Table

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("TOPOLOC_DATA", ROOT / ".." / "shared" / "data")) / "kitti_0039"
BINS = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build" / "release" / "bin"))


def stretch(table: Table, from_m: float, to_m: float) -> Path:
    """A part of the disturbed trajectory."""
    whole = table.truth.disturbed("slow", 7, table.work / "whole.tum").read_text().splitlines()
    part = table.work / f"stretch_{from_m:.0f}_{to_m:.0f}.tum"
    kept = [line for line, m in zip(whole, table.truth.way_m, strict=True) if from_m <= m <= to_m]
    part.write_text("\n".join(kept) + "\n")
    return part


def build(
    drive: Path, cloud: Path, out: Path, *start: str | Path
) -> subprocess.CompletedProcess[str]:
    """From a trajectory or an initial pose, with its registrations beside the map."""
    command: list[str | Path] = [BINS / "topoloc-map", "build", "--drive", drive, "--cloud", cloud]
    command += [*start, "--refine", "auto", "--out", out]
    return run(*command, "--registrations", out.with_suffix(".csv"))


def registrations(out: Path) -> list[dict[str, str]]:
    with out.with_suffix(".csv").open() as lines:
        return list(csv.DictReader(lines))


def drive_without(table: Table, name: str, file: str) -> Path:
    """A folder with all files of the drive but one."""
    drive = table.work / name
    drive.mkdir(exist_ok=True)
    for item in table.drive.iterdir():
        if item.name != file and not (drive / item.name).exists():
            (drive / item.name).symlink_to(item)
    return drive

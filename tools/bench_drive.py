# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The drive that the benches of the vehicle process play: a recorded one, or, where there is none,
one that the project makes itself."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

from demo import import_drive, is_new_source, note_source, run
from drive_variant import make_variant
from freshness import outdated

ROOT = Path(__file__).resolve().parent.parent
SIMULATED = "simulated"  # its folder
SIMULATION = ("--scenario", "town", "--seed", "1", "--length-km", "0.3")


def recorded_drive(given: Path | None) -> Path | None:
    """The drive given, else the shared KITTI drive 0039, else none."""
    if given is not None:
        if not given.is_dir():
            sys.exit(f"{given}: no such folder")
        return given
    shared = Path(os.environ.get("TOPOLOC_DATA", ROOT / "../shared/data")) / "kitti_0039"
    return shared if shared.is_dir() else None


def bench_drive(given: Path | None, work: Path, bins: Path) -> tuple[Path, Path]:
    """Drive folder in `work`, made where that is not done yet, and the cloud of the place.

    `given`: a recording to import, or a drive folder with its cloud.laz or cloud.ply.
    """
    work.mkdir(parents=True, exist_ok=True)
    recorded = recorded_drive(given)
    if recorded is None:
        drive = work / SIMULATED
        simulator = bins / "topoloc-simulate"
        if outdated(drive / "vehicle.yaml", [simulator]):
            print(f"no recorded drive (--drive, TOPOLOC_DATA): simulates one, {drive}", flush=True)
            run(simulator, *SIMULATION, "--out", drive, "--force")
        return drive, drive / "cloud.laz"
    drive = work / recorded.resolve().name
    if not (recorded / "vehicle.yaml").is_file():
        return drive, import_drive(recorded.resolve(), drive)
    clouds = [c for c in (recorded / "cloud.laz", recorded / "cloud.ply") if c.is_file()]
    if not clouds:
        sys.exit(f"{recorded}: a drive folder without cloud.laz or cloud.ply: nothing to map it by")
    if drive.resolve() == recorded.resolve():
        return drive, clouds[0]
    if is_new_source(drive, recorded.resolve()) or outdated(
        drive / "vehicle.yaml", [recorded / "vehicle.yaml"]
    ):
        shutil.rmtree(drive, ignore_errors=True)
        make_variant(recorded, drive, {})
        note_source(drive, recorded.resolve())
    return drive, clouds[0]

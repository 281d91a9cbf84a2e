#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Maps a place and localises in the map, with a report or plots; everything lands in demo/.

Without a drive: simulates one through a mixed world, maps it, and localises another day's drive in
that map. With one: maps a recorded drive from its even frames and localises its odd frames.
The filter starts from a pose that is wrong by 1 m and 3 degrees; the result is held against the
drive's ground truth. A second run does only what changed.
"""

import argparse
import subprocess
import sys
from pathlib import Path

import simulated_demo
from demo_start import start_pose
from freshness import outdated

ROOT = Path(__file__).resolve().parent.parent
BIN = ROOT / "build/release/bin"
SETTLED_AFTER_S = 2.0
NO_DRIVE = """\
demo: {reason}
A recorded drive (make demo DRIVE=path; without one, a drive is simulated)
  is a folder with image_00/, image_00.csv, imu.csv, speed.csv, ground_truth.tum and cloud.laz
  (KITTI drive 0039 as prepared for topoloc), or a drive of the KITTI raw data set
  (2011_09_26_drive_0009_sync: "synced+rectified data" and "calibration" from its download page,
  unpacked side by side). See docs/drive-folder.md."""
EXAMPLES = """examples:
  .venv/bin/python tools/demo.py
  .venv/bin/python tools/demo.py ../shared/data/kitti_0039
  .venv/bin/python tools/demo.py 2011_09_26/2011_09_26_drive_0009_sync --every-metres 2"""


def run(*command: str | Path) -> None:
    """Runs a program of the project, showing its command line."""
    shown = [str(c).removeprefix(f"{ROOT}/") for c in command]
    print("\n$", *(f'"{s}"' if " " in s else s for s in shown), flush=True)
    subprocess.run([str(c) for c in command], check=True)


def source_note(drive: Path) -> Path:
    return drive.with_name(f"{drive.name}.source")


def is_new_source(drive: Path, source: Path) -> bool:
    """Whether the drive folder was made of something else: another recording whose folder has the
    same name is no older version of this one."""
    note = source_note(drive)
    return not note.is_file() or note.read_text() != f"{source}\n"


def note_source(drive: Path, source: Path) -> None:
    source_note(drive).write_text(f"{source}\n")


def import_drive(source: Path, drive: Path) -> Path:
    """Makes the drive folder; returns the point cloud that belongs to it."""
    importer = ROOT / "tools/topoloc-import"
    ready_cloud = source / "cloud.laz"
    own_cloud = drive / "cloud.ply"
    if is_new_source(drive, source) or outdated(
        drive / "vehicle.yaml", [source, importer, ROOT / "tools/topoloc_import"]
    ):
        if ready_cloud.is_file():
            run(importer, "kitti-0039", source, "--out", drive, "--force")
        else:
            run(importer, "kitti-raw", source, "--out", drive, "--cloud", "--force")
        note_source(drive, source)
    return ready_cloud if ready_cloud.is_file() else own_cloud


def demo(source: Path, out: Path, every_metres: float) -> None:
    drive = out / source.name
    map_file = out / f"{source.name}_{every_metres:g}m.tmap"
    estimate = out / f"{source.name}.tum"
    plots = out / f"{source.name}_plots"
    out.mkdir(parents=True, exist_ok=True)
    cloud = import_drive(source, drive)
    truth = drive / "ground_truth.tum"
    if outdated(map_file, [drive, cloud, BIN / "topoloc-map"]):
        run(
            BIN / "topoloc-map", "build", "--drive", drive, "--cloud", cloud,
            "--trajectory", truth, "--frames", "even", "--every-metres", f"{every_metres:g}",
            "--out", map_file,
        )  # fmt: skip
    run(
        BIN / "topoloc-localise", "--drive", drive, "--map", map_file, "--frames", "odd",
        f"--initial-pose={start_pose(truth, disturbed=True)}", "--out", estimate,
    )  # fmt: skip
    run(
        BIN / "topoloc-evaluate", "--reference", truth, "--estimate", estimate,
        "--from-seconds", f"{SETTLED_AFTER_S:g}", "--plots", plots,
        "--json", out / f"{source.name}.json",
    )  # fmt: skip
    print(f"\nmap {map_file}, trajectory {estimate}, plots in {plots}/")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("drive", nargs="?", type=Path, help="a recording [simulate one]")
    parser.add_argument("--out", type=Path, default=ROOT / "demo", help="default: demo/")
    parser.add_argument("--every-metres", type=float, default=5.0, help="node spacing (default 5)")
    arguments = parser.parse_args()
    if not 0.1 <= arguments.every_metres <= 1000.0:
        parser.error(f"--every-metres: {arguments.every_metres:g}: expected 0.1 to 1000")
    if arguments.drive is None:
        return simulated_demo.run(
            arguments.out.resolve() / "simulated", BIN, arguments.every_metres
        )
    if not arguments.drive.is_dir():
        print(NO_DRIVE.format(reason=f"{arguments.drive}: no such folder"), file=sys.stderr)
        return 1
    try:
        demo(arguments.drive.resolve(), arguments.out.resolve(), arguments.every_metres)
    except subprocess.CalledProcessError as error:
        # The program has said why.
        print(f"demo: {Path(error.cmd[0]).name} failed", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Command line of tools/topoloc-import."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from topoloc_import.comma2k19 import import_comma2k19
from topoloc_import.drive_folder import create_folder
from topoloc_import.errors import DriveImportError
from topoloc_import.kitti_0039 import import_kitti_0039
from topoloc_import.kitti_raw import import_kitti_raw

DESCRIPTION = """\
Turns a public recording into a drive folder: can.log, camera.lcm, vehicle.yaml with its
calibration files, and ground_truth.tum (docs/drive-folder.md)."""

EXAMPLES = """\
examples:
  topoloc-import kitti-0039 data/kitti_0039 --out drives/kitti_0039
  topoloc-import comma2k19 data/comma2k19_example --out drives/comma2k19
  topoloc-import kitti-raw 2011_09_26/2011_09_26_drive_0009_sync --out drives/0009 --cloud

exit status: 0 done, 1 failed, 2 wrong usage"""


def parser() -> argparse.ArgumentParser:
    """The arguments."""
    top = argparse.ArgumentParser(
        prog="topoloc-import",
        description=DESCRIPTION,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    formats = top.add_subparsers(dest="format", required=True, metavar="FORMAT")
    for name, text in (
        ("kitti-0039", "drive 0039 unsynchronised: image_00.csv, imu.csv, speed.csv, ..."),
        ("comma2k19", "a comma2k19 segment: can.log, imu.csv, global_pose.csv, ... (no images)"),
        ("kitti-raw", "a KITTI raw drive: the ..._drive_NNNN_sync folder or the one around it"),
    ):
        command = formats.add_parser(name, help=text, description=text)
        command.add_argument("source", type=Path, metavar="SRC", help="folder of the recording")
        command.add_argument("--out", type=Path, required=True, metavar="DRIVE", help="new folder")
        command.add_argument("--force", action="store_true", help="replace an existing DRIVE")
    formats.choices["kitti-raw"].add_argument(
        "--cloud", action="store_true", help="also DRIVE/cloud.ply: all scans in world axes"
    )
    return top


def main(arguments: list[str] | None = None) -> int:
    """Runs the importer; returns the exit status."""
    args = parser().parse_args(arguments)
    try:
        if not args.source.is_dir():
            raise DriveImportError(f"{args.source}: no such folder")

        def fill(folder: Path) -> None:
            if args.format == "kitti-0039":
                import_kitti_0039(args.source, folder)
            elif args.format == "comma2k19":
                import_comma2k19(args.source, folder)
            else:
                import_kitti_raw(args.source, folder, args.cloud)

        create_folder(args.out, args.force, fill)
    except (DriveImportError, OSError) as error:
        print(f"topoloc-import: {error}", file=sys.stderr)
        return 1
    print(f"{args.out}: imported")
    return 0

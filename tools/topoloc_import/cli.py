# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Command line of tools/topoloc-import."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

from topoloc_import.comma2k19 import import_comma2k19
from topoloc_import.complex_urban import Options, import_complex_urban
from topoloc_import.complex_urban_cloud import LIDARS, CloudOptions
from topoloc_import.drive_folder import create_folder
from topoloc_import.errors import DriveImportError
from topoloc_import.kitti_0039 import import_kitti_0039
from topoloc_import.kitti_raw import CAMERAS, import_kitti_raw

DESCRIPTION = """\
Turns a public recording into a drive folder: can.log, camera.lcm, vehicle.yaml with its
calibration files, and ground_truth.tum (docs/drive-folder.md)."""

EXAMPLES = """\
examples:
  topoloc-import kitti-0039 data/kitti_0039 --out drives/kitti_0039
  topoloc-import comma2k19 data/comma2k19_example --out drives/comma2k19
  topoloc-import kitti-raw 2011_09_26/2011_09_26_drive_0009_sync --out drives/0009 --cloud
  topoloc-import complex-urban urban38 --out drives/urban38 --cloud --voxel 0.1

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
        (
            "complex-urban",
            "a Complex Urban Dataset recording: sensor_data/, image/, calibration/, ...",
        ),
    ):
        command = formats.add_parser(name, help=text, description=text)
        command.add_argument("source", type=Path, metavar="SRC", help="folder of the recording")
        command.add_argument("--out", type=Path, required=True, metavar="DRIVE", help="new folder")
        command.add_argument("--force", action="store_true", help="replace an existing DRIVE")
    formats.choices["kitti-raw"].add_argument(
        "--cloud", action="store_true", help="also DRIVE/cloud.ply: all scans in world axes"
    )
    formats.choices["kitti-raw"].add_argument(
        "--camera",
        choices=sorted(CAMERAS),
        help="its images are taken (default: 00, or else the first of 02, 01, 03 that has any)",
    )
    add_complex_urban(formats.choices["complex-urban"])
    return top


def add_complex_urban(command: argparse.ArgumentParser) -> None:
    """What only this format has."""
    default = CloudOptions()
    command.formatter_class = argparse.RawDescriptionHelpFormatter
    command.epilog = """\
example:
  topoloc-import complex-urban urban38 --out drives/urban38 --cloud --voxel 0.1
  topoloc-import complex-urban urban39 --out drives/urban39 --origin 333000 4140000 20"""
    command.add_argument(
        "--origin",
        type=metres,
        nargs=3,
        metavar=("EAST", "NORTH", "UP"),
        help="world origin in global_pose.csv's frame [m] (default: first pose, whole metres)",
    )
    command.add_argument(
        "--grey", action="store_true", help="one-channel images are grey, not a Bayer mosaic"
    )
    command.add_argument(
        "--cloud", action="store_true", help="also DRIVE/cloud.ply: LiDAR scans in world axes"
    )
    command.add_argument(
        "--voxel",
        type=metres_not_negative,
        metavar="M",
        help=f"one point per voxel of this edge; 0: all points (default {default.voxel_m:g})",
    )
    command.add_argument(
        "--max-range",
        type=metres_not_negative,
        metavar="M",
        help=f"leave out points farther from the scanner (default {default.max_range_m:g})",
    )
    command.add_argument(
        "--lidars",
        nargs="+",
        choices=list(LIDARS),
        metavar="LIDAR",
        help=f"of {', '.join(LIDARS)} (default {' '.join(default.lidars)})",
    )
    command.add_argument(
        "--deskew",
        action="store_true",
        help="place each Velodyne point at its own time, guessed from its azimuth",
    )


def metres(text: str) -> float:
    """A finite number."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)
    return value


def metres_not_negative(text: str) -> float:
    """A finite number from 0; voxels thinner than 1 cm are meant to be 0."""
    value = metres(text)
    if value < 0.0 or 0.0 < value < 0.01:
        raise argparse.ArgumentTypeError(f"{text}: expected 0 or at least 0.01")
    return value


def complex_urban_options(args: argparse.Namespace) -> Options:
    """The arguments that this format has of its own."""
    given: dict[str, Any] = {
        name: value
        for name, value in (
            ("voxel_m", args.voxel),
            ("max_range_m", args.max_range),
            ("lidars", tuple(dict.fromkeys(args.lidars)) if args.lidars else None),
            ("deskew", args.deskew or None),
        )
        if value is not None
    }
    if given and not args.cloud:
        parser().error("--voxel, --max-range, --lidars and --deskew need --cloud")
    return Options(
        origin_m=tuple(args.origin) if args.origin else None,
        grey=args.grey,
        cloud=CloudOptions(**given) if args.cloud else None,
    )


def main(arguments: list[str] | None = None) -> int:
    """Runs the importer; returns the exit status."""
    args = parser().parse_args(arguments)
    complex_urban = complex_urban_options(args) if args.format == "complex-urban" else Options()
    try:
        if not args.source.is_dir():
            raise DriveImportError(f"{args.source}: no such folder")

        def fill(folder: Path) -> None:
            if args.format == "kitti-0039":
                import_kitti_0039(args.source, folder)
            elif args.format == "comma2k19":
                import_comma2k19(args.source, folder)
            elif args.format == "complex-urban":
                import_complex_urban(args.source, folder, complex_urban)
            else:
                import_kitti_raw(args.source, folder, args.cloud, args.camera)

        create_folder(args.out, args.force, fill)
    except (DriveImportError, OSError) as error:
        print(f"topoloc-import: {error}", file=sys.stderr)
        return 1
    print(f"{args.out}: imported")
    return 0

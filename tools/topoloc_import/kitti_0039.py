# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""KITTI raw drive 2011_09_26_drive_0039, unsynchronised and unrectified, as one folder with
image_00.csv, imu.csv, speed.csv, ground_truth.tum, image_00/ and calib/."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from topoloc_import.can_log import InertialRow
from topoloc_import.drive_folder import (
    RT3003_BIAS,
    CameraModel,
    write_calibration,
    write_camera,
    write_sensors,
    write_vehicle,
)
from topoloc_import.errors import DriveImportError
from topoloc_import.images import jpeg_frame
from topoloc_import.kitti_calibration import KittiCalibration
from topoloc_import.kitti_mounting import KITTI_MOUNTING
from topoloc_import.kitti_oxts import undo_rate_lag
from topoloc_import.lcm_log import CameraFrame
from topoloc_import.progress import progress


def import_kitti_0039(source: Path, folder: Path) -> None:
    """Fills a drive folder. Truth: the file as it is."""
    rows = read_rows(source)
    images = read_table(source / "image_00.csv")
    if not images:
        raise DriveImportError(f"{source / 'image_00.csv'}: no image")
    calibration = KittiCalibration(source / "calib")
    K, distortion, T_cam_imu = calibration.raw_camera()
    first = jpeg_frame(source / images[0]["file"], int(images[0]["timestamp_ns"]))
    write_sensors(folder, undo_rate_lag(rows))
    copy_truth(source / "ground_truth.tum", folder / "ground_truth.tum")
    camera = CameraModel(first.width_px, first.height_px, K, distortion.tolist(), T_cam_imu)
    interval_s = float(np.median(np.diff([row.time_ns for row in rows]))) * 1e-9
    write_calibration(folder, camera, imu_rate_hz=1 / interval_s)
    write_vehicle(folder, "KITTI 2011_09_26_drive_0039", KITTI_MOUNTING, RT3003_BIAS)
    write_camera(folder, frames(source, images))


def read_rows(source: Path) -> list[InertialRow]:
    """imu.csv and speed.csv, which have the same time stamps."""
    imu, speed = read_table(source / "imu.csv"), read_table(source / "speed.csv")
    if len(imu) < 2 or [r["timestamp_ns"] for r in imu] != [r["timestamp_ns"] for r in speed]:
        raise DriveImportError(f"{source}: imu.csv and speed.csv do not have the same times")
    rows = []
    for line, (i, s) in enumerate(zip(imu, speed, strict=True), start=2):
        try:
            rows.append(
                InertialRow(
                    int(i["timestamp_ns"]),
                    (float(i["ax_mps2"]), float(i["ay_mps2"]), float(i["az_mps2"])),
                    (float(i["wx_radps"]), float(i["wy_radps"]), float(i["wz_radps"])),
                    float(s["vf_mps"]),
                )
            )
        except (KeyError, ValueError, TypeError) as error:
            raise DriveImportError(f"{source}: imu.csv, speed.csv line {line}: {error}") from error
    return rows


def read_table(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV file with a header."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))
    except OSError as error:
        raise DriveImportError(f"{path}: {error.strerror}") from error


def copy_truth(source: Path, target: Path) -> None:
    """The reference has the right format already."""
    try:
        shutil.copyfile(source, target)
    except OSError as error:
        raise DriveImportError(f"{source}: {error.strerror}") from error


def frames(source: Path, images: list[dict[str, str]]) -> Iterator[CameraFrame]:
    """The JPEG files as they are. KITTI's image time is the trigger in mid-exposure."""
    for image in progress(images, "images"):
        yield jpeg_frame(source / image["file"], int(image["timestamp_ns"]))

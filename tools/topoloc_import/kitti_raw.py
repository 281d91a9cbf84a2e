# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""KITTI raw drives in their original layout: DATE/calib_*.txt and
DATE/DATE_drive_NNNN_sync/{image_00,oxts,velodyne_points}."""

from __future__ import annotations

import bisect
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import numpy.typing as npt

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
from topoloc_import.images import any_grey_frame
from topoloc_import.kitti_calibration import KittiCalibration
from topoloc_import.kitti_mounting import KITTI_MOUNTING
from topoloc_import.kitti_oxts import undo_rate_lag
from topoloc_import.lcm_log import CameraFrame
from topoloc_import.progress import progress
from topoloc_import.trajectory import Trajectory, mercator_trajectory, write_tum
from topoloc_import.velodyne import write_cloud

NS_PER_S = 1_000_000_000
# Recordings whose GNSS/INS goes on without images are cut to the images and this much around them.
MARGIN_NS = NS_PER_S
# By preference: left grey, left colour, then the right ones. Rectified images all have one centre
# line and the axes of camera 00.
CAMERAS = ("00", "02", "01", "03")
IMAGE_SUFFIXES = ("png", "jpg", "jpeg")
OXTS_COLUMNS = 30  # of dataformat.txt; the ones used here:
ROLL_PITCH_YAW = slice(3, 6)
FORWARD_SPEED = 8
ACCELERATION = slice(11, 14)
ANGULAR_RATE = slice(17, 20)


def import_kitti_raw(source: Path, folder: Path, cloud: bool, camera_name: str | None) -> None:
    """Fills a drive folder, with `cloud` also its cloud.ply from the scans."""
    drive = find_drive(source)
    calibration = KittiCalibration(drive.parent)
    camera_name, images = find_images(drive, camera_name)
    rows, truth = read_oxts(drive, images[0][0], images[-1][0])
    first = any_grey_frame(images[0][1], images[0][0])
    size_px = calibration.rectified_size_px(camera_name)
    if size_px and size_px != (first.width_px, first.height_px):
        raise DriveImportError(
            f"{images[0][1]}: {first.width_px}x{first.height_px} pixels, and rectified ones have "
            f"{size_px[0]}x{size_px[1]}: is it of a ..._sync drive, and of the calibration's day?"
        )
    K, T_cam_imu = calibration.rectified_camera(camera_name)
    camera = CameraModel(first.width_px, first.height_px, K, [], T_cam_imu)
    write_sensors(folder, undo_rate_lag(rows))
    write_tum(folder / "ground_truth.tum", truth)
    interval_s = float(np.median(np.diff(truth.time_ns))) * 1e-9
    write_calibration(folder, camera, imu_rate_hz=1 / interval_s)
    write_vehicle(folder, f"KITTI {drive.name}", KITTI_MOUNTING, RT3003_BIAS)
    write_camera(folder, frames(images))
    if cloud:
        scans = numbered_files(drive / "velodyne_points", "bin")
        if not scans:
            raise DriveImportError(f"{drive / 'velodyne_points' / 'data'}: no scan")
        write_cloud(folder / "cloud.ply", scans, truth, calibration.T_velo_imu)


def find_images(drive: Path, camera: str | None) -> tuple[str, list[tuple[int, Path]]]:
    """The camera of that name, or the first that has images, and these."""
    for name in [camera] if camera else CAMERAS:
        folder = drive / f"image_{name}"
        if (folder / "data").is_dir():
            images = in_order(numbered_files(folder, *IMAGE_SUFFIXES), f"image_{name}")
            if images:
                if name != CAMERAS[0]:
                    print(f"camera: image_{name}")
                return name, images
    wanted = f"image_{camera}" if camera else "any of image_00 to image_03"
    raise DriveImportError(f"{drive}: no image in data/ of {wanted}")


def in_order(files: list[tuple[int, Path]], what: str) -> list[tuple[int, Path]]:
    """As many of them as have increasing times; the others are counted."""
    best: list[int] = []  # the last file of the best row of each length; its times increase
    times: list[int] = []
    before: list[int | None] = []
    for i, (time_ns, _) in enumerate(files):
        length = bisect.bisect_left(times, time_ns)
        before.append(best[length - 1] if length else None)
        best[length : length + 1] = [i]
        times[length : length + 1] = [time_ns]
    kept: list[tuple[int, Path]] = []
    at = best[-1] if best else None
    while at is not None:
        kept.append(files[at])
        at = before[at]
    if len(kept) < len(files):
        print(f"{what}: {len(files) - len(kept)} of {len(files)} left out, for times out of order")
    return kept[::-1]


def find_drive(source: Path) -> Path:
    """The ..._sync folder itself, or the only one in a date folder."""
    if (source / "oxts").is_dir():
        return source
    drives = sorted(d for d in source.glob("*_drive_*_sync") if d.is_dir())
    if not drives:  # the folder that holds the date folder
        drives = sorted(d for d in source.glob("*/*_drive_*_sync") if d.is_dir())
    if len(drives) != 1:
        found = ", ".join(d.name for d in drives) or "none"
        raise DriveImportError(f"{source}: expected one ..._drive_NNNN_sync folder, found {found}")
    return drives[0]


def parse_time_ns(text: str) -> int:
    """KITTI's wall-clock time, read as if UTC, to the nanosecond."""
    seconds, _, fraction = text.strip().partition(".")
    moment = datetime.strptime(seconds, "%Y-%m-%d %H:%M:%S").replace(tzinfo=UTC)
    return int(moment.timestamp()) * NS_PER_S + int(fraction.ljust(9, "0")[:9] or 0)


def read_times(path: Path) -> list[int | None]:
    """A timestamps file: line n + 1 belongs to number n; KITTI leaves lost ones blank."""
    try:
        lines = path.read_text(encoding="ascii").splitlines()
    except OSError as error:
        raise DriveImportError(f"{path}: {error.strerror}") from error
    times: list[int | None] = []
    for number, line in enumerate(lines, start=1):
        try:
            times.append(parse_time_ns(line) if line.strip() else None)
        except ValueError as error:
            raise DriveImportError(f"{path}:{number}: not a time: {line!r}") from error
    return times


def numbered_files(folder: Path, *suffixes: str) -> list[tuple[int, Path]]:
    """(time, file) of data/NNNNNNNNNN.suffix by number: the numbering may have gaps."""
    times = read_times(folder / "timestamps.txt")
    files = []
    for file in sorted(f for f in (folder / "data").glob("*.*") if f.suffix[1:] in suffixes):
        if not file.stem.isdigit():
            raise DriveImportError(f"{file}: the name is not a number")
        number = int(file.stem)
        time_ns = times[number] if number < len(times) else None
        if time_ns is None:
            raise DriveImportError(f"{file}: no time in line {number + 1} of timestamps.txt")
        files.append((time_ns, file))
    return files


def read_oxts(drive: Path, first_ns: int, last_ns: int) -> tuple[list[InertialRow], Trajectory]:
    """The GNSS/INS rows around the images as IMU and speed, and as reference."""
    files = numbered_files(drive / "oxts", "txt")
    near = [f for f in files if first_ns - MARGIN_NS <= f[0] <= last_ns + MARGIN_NS]
    if len(near) < 2:
        raise DriveImportError(f"{drive / 'oxts'}: fewer than two rows at the time of the images")
    if len(near) < len(files):
        print(
            f"oxts: {len(near)} of {len(files)} rows lie within 1 s of the images; others left out"
        )
    near = in_order(near, "oxts")
    if len(near) < 2:
        raise DriveImportError(f"{drive / 'oxts'}: the times of its rows do not increase")
    time_ns = np.array([time for time, _ in near], dtype=np.int64)
    table = np.stack([read_row(file) for _, file in near])
    rows = [
        InertialRow(time, (a[0], a[1], a[2]), (w[0], w[1], w[2]), v)
        for time, a, w, v in zip(
            time_ns.tolist(),
            table[:, ACCELERATION].tolist(),
            table[:, ANGULAR_RATE].tolist(),
            table[:, FORWARD_SPEED].tolist(),
            strict=True,
        )
    ]
    return rows, mercator_trajectory(time_ns, table[:, :3], table[:, ROLL_PITCH_YAW])


def read_row(file: Path) -> npt.NDArray[np.float64]:
    """The 30 numbers of one OXTS file."""
    try:
        row = np.array([float(word) for word in file.read_text(encoding="ascii").split()])
    except (OSError, ValueError) as error:
        raise DriveImportError(f"{file}: {error}") from error
    if row.size != OXTS_COLUMNS or not np.isfinite(row).all():
        raise DriveImportError(f"{file}: expected {OXTS_COLUMNS} finite numbers, found {row.size}")
    return row


def frames(images: list[tuple[int, Path]]) -> Iterator[CameraFrame]:
    """Rectified images. KITTI's image time is the trigger, taken as mid-exposure."""
    for time_ns, file in progress(images, "images"):
        yield any_grey_frame(file, time_ns)

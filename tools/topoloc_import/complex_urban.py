# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Recordings of the Complex Urban Dataset (Jeong et al., IJRR 2019) in their public layout:
sensor_data/, image/stereo_left/, calibration/ and global_pose.csv."""

from __future__ import annotations

import heapq
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from topoloc_import.can_log import SensorFrames
from topoloc_import.complex_urban_cloud import CloudOptions, write_cloud
from topoloc_import.complex_urban_files import (
    EncoderParameters,
    Intrinsics,
    Table,
    files_by_time,
    read_camera,
    read_encoder_parameters,
    read_mounting,
    read_table,
)
from topoloc_import.drive_folder import (
    DBC,
    CameraModel,
    ImuNoise,
    Mounting,
    write_calibration,
    write_camera,
    write_vehicle,
)
from topoloc_import.errors import DriveImportError
from topoloc_import.images import grey_frame, mosaic_frame
from topoloc_import.kitti_calibration import Matrix, inverse
from topoloc_import.lcm_log import CameraFrame
from topoloc_import.progress import progress
from topoloc_import.trajectory import Trajectory, write_tum

Array = npt.NDArray[np.float64]

IMU_COLUMNS = 16  # quaternion x y z w, Euler angles, rates, specific force, magnetic field
ANGULAR_RATE = slice(7, 10)
ACCELERATION = slice(10, 13)
POSE_COLUMNS = 12
ENCODER_COLUMNS = 2
MAX_ENCODER_INTERVAL_NS = 500_000_000  # over a longer one a mean speed says little
MAX_SPEED_MPS = 65.0  # of the DBC

MTI_100_SERIES = ImuNoise(
    accel_noise_density=0.006,
    accel_random_walk=0.0003,
    gyro_noise_density=0.0003,
    gyro_random_walk=0.00001,
    comment="Xsens MTi-100 series: the data sheet's densities (60 ug, 0.01 deg/s per sqrt(Hz))\n"
    "times ten and almost two, for a vibrating car. Not measured on this data.",
)


@dataclass(frozen=True)
class Options:
    """What the command line may say besides the folders."""

    origin_m: tuple[float, float, float] | None = None  # None: first pose, whole metres
    grey: bool = False  # images are grey, no colour mosaic
    cloud: CloudOptions | None = None


def import_complex_urban(source: Path, folder: Path, options: Options) -> None:
    """Fills a drive folder. Truth: global_pose.csv, moved to the IMU."""
    calibration = source / "calibration"
    T_vehicle_imu = read_mounting(calibration, "IMU")
    T_vehicle_cam = read_mounting(calibration, "Stereo")
    encoder = read_encoder_parameters(calibration / "EncoderParameter.txt")
    intrinsics = read_camera(calibration / "left.yaml")
    images = files_by_time(source / "image" / "stereo_left", "png")
    if not images:
        raise DriveImportError(f"{source / 'image' / 'stereo_left'}: no image")
    imu = read_imu(source / "sensor_data" / "xsens_imu.csv")
    wheels = wheel_speeds(read_table(source / "sensor_data" / "encoder.csv", 2), encoder)
    origin_m, T_world_vehicle = read_poses(source / "global_pose.csv", options.origin_m)

    write_can(folder, imu, wheels)
    write_tum(folder / "ground_truth.tum", moved(T_world_vehicle, T_vehicle_imu))
    write_world(folder / "world.yaml", origin_m)
    rate_hz = 1e9 / float(np.median(np.diff(imu.time_ns)))
    T_cam_imu = inverse(T_vehicle_cam) @ T_vehicle_imu
    write_calibration(folder, camera_model(intrinsics, T_cam_imu), rate_hz, MTI_100_SERIES)
    write_vehicle(folder, f"Complex Urban {source.resolve().name}", mounting(T_vehicle_imu))
    write_camera(folder, frames(images, intrinsics, options.grey))
    if options.cloud is not None:
        comment = "origin_m " + " ".join(repr(v) for v in origin_m)
        write_cloud(folder / "cloud.ply", source, T_world_vehicle, options.cloud, comment)


def read_imu(path: Path) -> Table:
    """xsens_imu.csv; early recordings have a shorter one without rates and specific force."""
    try:
        with path.open(encoding="ascii", errors="replace") as file:
            columns = len(file.readline().split(","))
    except OSError as error:
        raise DriveImportError(f"{path}: {error.strerror}") from error
    if columns == 8:
        raise DriveImportError(f"{path}:1: 8 columns: attitude only, no rates and specific force")
    return read_table(path, IMU_COLUMNS)


@dataclass(frozen=True)
class WheelSpeeds:
    """Forward speeds [m/s] with their signs at times [ns]."""

    time_ns: npt.NDArray[np.int64]
    left_mps: Array
    right_mps: Array


def wheel_speeds(counts: Table, encoder: EncoderParameters) -> WheelSpeeds:
    """Mean speeds between the rows of encoder.csv (running counts, left and right, more when going
    forward), stamped in the middle between these rows. Intervals that are too long (lost rows) and
    steps that no wheel turns (a counter set back) are left out and reported."""
    interval_ns = np.diff(counts.time_ns)
    diameter_m = np.array([encoder.left_diameter_m, encoder.right_diameter_m])
    turns = np.diff(counts.values, axis=0) / encoder.counts_per_turn
    speed_mps = turns * np.pi * diameter_m / (interval_ns[:, None] * 1e-9)
    long = interval_ns > MAX_ENCODER_INTERVAL_NS
    leap = ~long & (np.abs(speed_mps).max(axis=1) > MAX_SPEED_MPS)
    for bad, what in (
        (long, f"intervals are longer than {MAX_ENCODER_INTERVAL_NS * 1e-9:g} s"),
        (leap, f"steps mean more than {MAX_SPEED_MPS:g} m/s"),
    ):
        if bad.any():
            line = counts.line[int(np.argmax(bad)) + 1]
            print(
                f"{counts.path.name}: {np.count_nonzero(bad)} {what} (first: line {line}); left out"
            )
    good = ~long & ~leap
    if not good.any():
        raise DriveImportError(f"{counts.path}: no usable step between counts")
    middle_ns = counts.time_ns[:-1] + interval_ns // 2
    return WheelSpeeds(middle_ns[good], speed_mps[good, 0], speed_mps[good, 1])


def read_poses(
    path: Path, origin_m: tuple[float, float, float] | None
) -> tuple[tuple[float, float, float], Trajectory]:
    """The world's origin in the file's frame and T_world_vehicle. Rows of 3x4 matrices, row by
    row, in UTM: x east, y north, z up. Rotations are printed with few digits: made exact."""
    table = read_table(path, POSE_COLUMNS)
    pose = table.values.reshape(-1, 3, 4)
    u, singular, vt = np.linalg.svd(pose[:, :, :3])
    rotation = u @ vt
    bad = (np.linalg.det(rotation) < 0) | (np.abs(singular - 1).max(axis=1) > 1e-3)
    if bad.any():
        raise DriveImportError(
            f"{path}:{table.line[int(np.argmax(bad))]}: not a rotation matrix and a position"
        )
    if origin_m is None:
        east, north, up = np.rint(pose[0, :, 3]).tolist()
        origin_m = (east, north, up)
    return origin_m, Trajectory(table.time_ns, pose[:, :, 3] - np.array(origin_m), rotation)


def moved(T_world_a: Trajectory, T_a_b: Matrix) -> Trajectory:
    """T_world_b."""
    position = T_world_a.rotation @ T_a_b[:3, 3] + T_world_a.position_m
    return Trajectory(T_world_a.time_ns, position, T_world_a.rotation @ T_a_b[:3, :3])


def write_can(folder: Path, imu: Table, wheels: WheelSpeeds) -> None:
    """can.log, IMU and wheels each at their own times, and the DBC beside it."""
    shutil.copyfile(DBC, folder / DBC.name)
    frames = SensorFrames(DBC)

    def imu_lines() -> Iterator[tuple[int, list[str]]]:
        for i in progress(range(len(imu.time_ns)), "IMU rows"):
            time_ns, row = int(imu.time_ns[i]), imu.values[i]
            (ax, ay, az), (wx, wy, wz) = row[ACCELERATION].tolist(), row[ANGULAR_RATE].tolist()
            yield time_ns, frames.imu_lines(time_ns, (ax, ay, az), (wx, wy, wz))

    def wheel_lines() -> Iterator[tuple[int, list[str]]]:
        for time_ns, left, right in zip(
            wheels.time_ns.tolist(),
            wheels.left_mps.tolist(),
            wheels.right_mps.tolist(),
            strict=True,
        ):
            yield time_ns, frames.wheel_lines(time_ns, left, right)

    merged = heapq.merge(imu_lines(), wheel_lines(), key=lambda sample: sample[0])
    with (folder / "can.log").open("w", encoding="ascii", newline="\n") as file:
        for _, lines in merged:
            file.writelines(line + "\n" for line in lines)


def camera_model(intrinsics: Intrinsics, T_cam_imu: Matrix) -> CameraModel:
    """The camera without the skew of its matrix, which camchain.yaml has no place for."""
    K, height_px = intrinsics.K, intrinsics.height_px
    error_px = abs(K[0, 1] / K[1, 1]) * max(K[1, 2], height_px - 1 - K[1, 2])
    if error_px > 0.0:
        print(f"left.yaml: skew of {K[0, 1]:g} px left out: {error_px:.2f} px at the image's edge")
    return CameraModel(intrinsics.width_px, height_px, K, intrinsics.radtan, T_cam_imu)


def mounting(T_vehicle_imu: Matrix) -> Mounting:
    """The vehicle's axes and origin seen from the IMU."""
    R = T_vehicle_imu[:3, :3]
    roll = float(np.arctan2(R[2, 1], R[2, 2]))
    pitch = float(np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0])))
    yaw = float(np.arctan2(R[1, 0], R[0, 0]))
    x, y, z = (float(v) for v in inverse(T_vehicle_imu)[:3, 3])
    return Mounting(
        (roll, pitch, yaw),
        (x, y, z),
        "calibration/Vehicle2IMU.txt. The reference point is the origin of the vehicle's axes,\n"
        "taken as the middle of the rear axle.",
    )


def write_world(path: Path, origin_m: tuple[float, float, float]) -> None:
    """Where the world of this drive lies: no program reads it."""
    path.write_text(
        f"""# World frame of ground_truth.tum and cloud.ply: that of global_pose.csv (UTM: x east,
# y north, z up, metres) minus this origin. --origin gives several drives the same one.
origin_m: [{", ".join(repr(v) for v in origin_m)}]
""",
        encoding="ascii",
    )


def frames(
    images: list[tuple[int, Path]], intrinsics: Intrinsics, grey: bool
) -> Iterator[CameraFrame]:
    """The left images as grey ones. Their times are taken as mid-exposure."""
    size = (intrinsics.width_px, intrinsics.height_px)
    for time_ns, file in progress(images, "images"):
        frame = grey_frame(file, time_ns) if grey else mosaic_frame(file, time_ns)
        if (frame.width_px, frame.height_px) != size:
            raise DriveImportError(
                f"{file}: {frame.width_px}x{frame.height_px} px,"
                f" but left.yaml has {size[0]}x{size[1]}"
            )
        yield frame

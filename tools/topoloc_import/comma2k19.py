# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""A comma2k19 segment as one folder with can.log, toyota_wheel_speeds.dbc, imu.csv and
global_pose.csv: real wheel speeds from the car's bus, a phone's IMU, no images."""

from __future__ import annotations

import heapq
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import cantools
import numpy as np
import numpy.typing as npt
from cantools.database.can import Database

from topoloc_import.can_log import SensorFrames
from topoloc_import.drive_folder import DBC, ImuNoise, write_imu_noise
from topoloc_import.errors import DriveImportError
from topoloc_import.geodesy import rotation_enu_ecef
from topoloc_import.kitti_0039 import read_table
from topoloc_import.trajectory import Trajectory, rotations, write_tum

Array = npt.NDArray[np.float64]

CAR_DBC = "toyota_wheel_speeds.dbc"
CAR_INTERFACE = "can0"
IMU_INTERFACE = "imu0"  # a bus of its own: both DBC files are free to use any id
# The source's axes are forward, right, down; an IMU here looks forward, left, up.
FLU_FRD = np.diag([1.0, -1.0, -1.0])
FORCE_COLUMNS = ("ax_mps2", "ay_mps2", "az_mps2")
# As the sensor gives it: Android's own bias estimate would already be a calibration.
RATE_COLUMNS = ("wx_uncalibrated_radps", "wy_uncalibrated_radps", "wz_uncalibrated_radps")
POSITION_COLUMNS = ("x_ecef_m", "y_ecef_m", "z_ecef_m")
QUATERNION_COLUMNS = ("qx", "qy", "qz", "qw")
FRAME_LINE = re.compile(r"\((\d+)\.(\d{6})\) (\S+) ([0-9A-F]{3})#")

PHONE = ImuNoise(
    accel_noise_density=0.02,
    accel_random_walk=0.0005,
    gyro_noise_density=0.0005,
    gyro_random_walk=0.00001,
    comment="A phone on a windscreen: several times a MEMS data sheet's densities, since the\n"
    "mount vibrates.",
)


def import_comma2k19(source: Path, folder: Path) -> None:
    """Fills a drive folder without camera.lcm. Truth: global_pose.csv."""
    imu_time_ns, imu = read_columns(source / "imu.csv", FORCE_COLUMNS + RATE_COLUMNS)
    pose_time_ns, poses = read_columns(
        source / "global_pose.csv", POSITION_COLUMNS + QUATERNION_COLUMNS
    )
    shutil.copyfile(DBC, folder / DBC.name)
    shutil.copyfile(source / CAR_DBC, folder / CAR_DBC)
    # All frames that the car's DBC knows, as they are, between those of the IMU.
    merged = heapq.merge(car_frames(source), imu_frames(imu_time_ns, imu), key=lambda line: line[0])
    with (folder / "can.log").open("w", encoding="ascii", newline="\n") as file:
        file.writelines(line for _, line in merged)
    write_tum(folder / "ground_truth.tum", trajectory(pose_time_ns, poses))
    write_imu_noise(folder, PHONE, 1e9 / float(np.median(np.diff(imu_time_ns))))
    write_vehicle(folder, source.name)


def read_columns(path: Path, columns: tuple[str, ...]) -> tuple[npt.NDArray[np.int64], Array]:
    """Times and the named columns of a CSV file."""
    rows = read_table(path)
    if len(rows) < 2:
        raise DriveImportError(f"{path}: fewer than two rows")
    try:
        time_ns = np.array([int(row["timestamp_ns"]) for row in rows], dtype=np.int64)
        values = np.array([[float(row[name]) for name in columns] for row in rows])
    except (KeyError, ValueError, TypeError) as error:
        raise DriveImportError(f"{path}: {error}") from error
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1) | (np.diff(time_ns, prepend=0) <= 0))
    if bad.size:
        raise DriveImportError(f"{path}:{bad[0] + 2}: not finite, or time does not increase")
    return time_ns, values


def car_frames(source: Path) -> Iterator[tuple[int, str]]:
    """(microseconds, candump line) of the received frames that the car's DBC describes."""
    database = cantools.database.load_file(source / CAR_DBC, strict=True)
    if not isinstance(database, Database):
        raise DriveImportError(f"{source / CAR_DBC}: not a CAN database")
    wanted = {f"{message.frame_id:03X}" for message in database.messages}
    with (source / "can.log").open(encoding="ascii") as file:
        for number, line in enumerate(file, start=1):
            match = FRAME_LINE.match(line)
            if match is None:
                raise DriveImportError(f"{source / 'can.log'}:{number}: not a frame: {line!r}")
            seconds, micros, interface, frame_id = match.groups()
            if interface == CAR_INTERFACE and frame_id in wanted:
                yield int(seconds) * 1_000_000 + int(micros), line


def imu_frames(time_ns: npt.NDArray[np.int64], imu: Array) -> Iterator[tuple[int, str]]:
    """(microseconds, candump line) of the IMU samples, turned to forward, left, up."""
    frames = SensorFrames(DBC, IMU_INTERFACE)
    for time, force, rate in zip(
        time_ns.tolist(), imu[:, :3] @ FLU_FRD, imu[:, 3:] @ FLU_FRD, strict=True
    ):
        for line in frames.imu_lines(time, (*force.tolist(),), (*rate.tolist(),)):
            yield (time + 500) // 1000, line + "\n"


def trajectory(time_ns: npt.NDArray[np.int64], poses: Array) -> Trajectory:
    """T_world_imu in east, north, up axes at the first pose. The phone is camera and IMU in one,
    so the camera's position is the IMU's; the quaternion takes camera axes to ECEF axes."""
    position, quaternion = poses[:, :3], poses[:, 3:]
    R_enu_ecef = rotation_enu_ecef(position[0])
    R_ecef_frd = rotations(quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True))
    return Trajectory(
        time_ns, (position - position[0]) @ R_enu_ecef.T, R_enu_ecef @ R_ecef_frd @ FLU_FRD
    )


def write_vehicle(folder: Path, name: str) -> None:
    """vehicle.yaml: two buses with a DBC each, no camera, nothing calibrated yet."""
    (folder / "vehicle.yaml").write_text(
        f"""# Every key: docs/vehicle-config.md
format: 1
name: comma2k19 {name}
can:
  dbc: [{CAR_DBC}, {DBC.name}]
  imu:
    acceleration: [IMU_ACCEL.ACCEL_X, IMU_ACCEL.ACCEL_Y, IMU_ACCEL.ACCEL_Z]
    angular_rate: [IMU_RATE.RATE_X, IMU_RATE.RATE_Y, IMU_RATE.RATE_Z]
    counters: [IMU_ACCEL.ACCEL_COUNTER, IMU_RATE.RATE_COUNTER]
    interface: {IMU_INTERFACE}
  wheels:
    speeds: [WHEEL_SPEEDS.WHEEL_SPEED_FL, WHEEL_SPEEDS.WHEEL_SPEED_FR,
             WHEEL_SPEEDS.WHEEL_SPEED_RL, WHEEL_SPEEDS.WHEEL_SPEED_RR]
    interface: {CAR_INTERFACE}
imu:
  calibration: imu.yaml
vehicle:
  # Rotation and scale are for topoloc-calibrate to find.
  rotation_vehicle_imu_rpy_rad: [0.0, 0.0, 0.0]
  # A phone on the windscreen, the rear axle behind and below it. Rough: only turns show it.
  wheel_reference_imu_m: [-1.8, 0.0, -1.0]
  wheel_scale: 1.0
""",
        encoding="ascii",
    )

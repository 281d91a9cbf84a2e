# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Writes a drive folder (docs/drive-folder.md): complete or not at all."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from topoloc_import.can_log import InertialRow, write_can_log
from topoloc_import.errors import DriveImportError
from topoloc_import.kitti_calibration import Matrix
from topoloc_import.lcm_log import CameraFrame, CameraLog

DBC = Path(__file__).resolve().parents[2] / "config" / "topoloc_imu_wheel.dbc"
CHANNEL = "CAMERA"


@dataclass(frozen=True)
class CameraModel:
    """What camchain.yaml says of the camera."""

    width_px: int
    height_px: int
    K: Matrix
    radtan: Sequence[float]  # k1 k2 p1 p2 [k3]; empty: no distortion
    T_cam_imu: Matrix


@dataclass(frozen=True)
class Mounting:
    """Vehicle part of vehicle.yaml and where its numbers come from."""

    rotation_vehicle_imu_rpy_rad: tuple[float, float, float]
    wheel_reference_imu_m: tuple[float, float, float]
    comment: str


@dataclass(frozen=True)
class ImuNoise:
    """What imu.yaml says of the IMU: continuous densities in SI units."""

    accel_noise_density: float
    accel_random_walk: float
    gyro_noise_density: float
    gyro_random_walk: float
    comment: str


RT3003 = ImuNoise(
    accel_noise_density=0.03,
    accel_random_walk=0.001,
    gyro_noise_density=0.0013,
    gyro_random_walk=0.00001,
    comment="RT3003 as recorded by KITTI. The densities stand for more than the sensor's own\n"
    "noise: samples come tens of milliseconds apart, and between them the true motion is unknown.\n"
    "Measured on 20 other drives at 10 Hz (largest axis): tools/oxts_noise.py",
)


@dataclass(frozen=True)
class BiasStd:
    """How well the turn-on biases of an IMU are known, one standard deviation per axis."""

    gyro_radps: float
    accel_mps2: float
    comment: str


RT3003_BIAS = BiasStd(
    gyro_radps=0.0005,
    accel_mps2=0.01,
    comment="The RT3003 takes its own biases off: tools/oxts_noise.py finds none above 0.9 mrad/s\n"
    "and 0.016 m/s^2 in 20 other drives.",
)


def create_folder(out: Path, force: bool, fill: Callable[[Path], None]) -> None:
    """Lets `fill` make the folder beside its place, then renames it: `out` is never half done.
    An existing folder is replaced only with `force`, and only if it is empty or a drive folder."""
    out = out.absolute()
    if out.exists():
        if not out.is_dir():
            raise DriveImportError(f"{out} exists and is not a folder")
        if any(out.iterdir()):
            if not (out / "vehicle.yaml").exists():
                raise DriveImportError(f"{out} exists and is not a drive folder")
            if not force:
                raise DriveImportError(f"{out} exists (--force replaces it)")
    out.parent.mkdir(parents=True, exist_ok=True)
    partial = out.with_name(out.name + ".partial")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir()
    try:
        fill(partial)
        if out.exists():
            shutil.rmtree(out)
        partial.rename(out)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def write_sensors(folder: Path, rows: Iterable[InertialRow]) -> None:
    """can.log and the DBC beside it."""
    shutil.copyfile(DBC, folder / DBC.name)
    write_can_log(folder / "can.log", DBC, rows)


def write_camera(folder: Path, frames: Iterable[CameraFrame]) -> None:
    """camera.lcm."""
    last_us: int | None = None
    with CameraLog(folder / "camera.lcm", CHANNEL) as log:
        for frame in frames:
            if last_us is not None and frame.time_us <= last_us:
                raise DriveImportError(
                    f"image time {frame.time_us} us does not come after {last_us}"
                )
            last_us = frame.time_us
            log.write(frame)


def write_calibration(
    folder: Path, camera: CameraModel, imu_rate_hz: float, noise: ImuNoise = RT3003
) -> None:
    """camchain.yaml and imu.yaml in Kalibr's layout."""
    fx, fy, cx, cy = camera.K[0, 0], camera.K[1, 1], camera.K[0, 2], camera.K[1, 2]
    rows = "\n".join(f"  - {_numbers(row)}" for row in camera.T_cam_imu)
    # Kalibr spells an undistorted camera "none" with no coefficients.
    model = "radtan" if camera.radtan else "none"
    (folder / "camchain.yaml").write_text(
        f"""cam0:
  camera_model: pinhole
  intrinsics: {_numbers([fx, fy, cx, cy])}
  distortion_model: {model}
  distortion_coeffs: {_numbers(camera.radtan)}
  resolution: [{camera.width_px}, {camera.height_px}]
  T_cam_imu:
{rows}
  timeshift_cam_imu: 0.0
""",
        encoding="ascii",
    )
    write_imu_noise(folder, noise, imu_rate_hz)


def write_imu_noise(folder: Path, noise: ImuNoise, rate_hz: float) -> None:
    """imu.yaml in Kalibr's layout."""
    (folder / "imu.yaml").write_text(
        f"""{_comment(noise.comment)}
accelerometer_noise_density: {decimal(noise.accel_noise_density)}  # m/s^2/sqrt(Hz)
accelerometer_random_walk: {decimal(noise.accel_random_walk)}  # m/s^3/sqrt(Hz)
gyroscope_noise_density: {decimal(noise.gyro_noise_density)}  # rad/s/sqrt(Hz)
gyroscope_random_walk: {decimal(noise.gyro_random_walk)}  # rad/s^2/sqrt(Hz)
update_rate: {rate_hz:.1f}
""",
        encoding="ascii",
    )


def decimal(value: float) -> str:
    """Without exponent, as people write it."""
    return f"{value:.8f}".rstrip("0")


def write_vehicle(folder: Path, name: str, mounting: Mounting, bias: BiasStd | None = None) -> None:
    """vehicle.yaml: what this car must state; everything else keeps its default."""
    bias_text = ""
    if bias:
        bias_text = f"""{_comment(bias.comment, indent=2)}
  gyro_bias_std_radps: {decimal(bias.gyro_radps)}
  accel_bias_std_mps2: {decimal(bias.accel_mps2)}
"""
    (folder / "vehicle.yaml").write_text(
        f"""# Every key: docs/vehicle-config.md
format: 1
name: {name}
can:
  dbc: {DBC.name}
  imu:
    acceleration: [IMU_ACCEL.ACCEL_X, IMU_ACCEL.ACCEL_Y, IMU_ACCEL.ACCEL_Z]
    angular_rate: [IMU_RATE.RATE_X, IMU_RATE.RATE_Y, IMU_RATE.RATE_Z]
    counters: [IMU_ACCEL.ACCEL_COUNTER, IMU_RATE.RATE_COUNTER]
  wheels:
    speeds: [WHEEL_SPEEDS.FRONT_LEFT, WHEEL_SPEEDS.FRONT_RIGHT,
             WHEEL_SPEEDS.REAR_LEFT, WHEEL_SPEEDS.REAR_RIGHT]
  direction:
    signal: TRAVEL_DIRECTION.DIRECTION
    reverse_values: [REVERSE]
camera:
  calibration: camchain.yaml
  name: cam0
  channel: {CHANNEL}
imu:
  calibration: imu.yaml
{bias_text}vehicle:
{_comment(mounting.comment, indent=2)}
  rotation_vehicle_imu_rpy_rad: {_numbers(mounting.rotation_vehicle_imu_rpy_rad)}
  wheel_reference_imu_m: {_numbers(mounting.wheel_reference_imu_m)}
  wheel_scale: 1.0
""",
        encoding="ascii",
    )


def _comment(text: str, indent: int = 0) -> str:
    return "\n".join(f"{' ' * indent}# {line}" for line in text.splitlines())


def _numbers(values: Sequence[float] | Matrix) -> str:
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"

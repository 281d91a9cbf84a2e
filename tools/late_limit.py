#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""How accurate the pose of now can be when matches come late, with the estimator's own models.

The reference's own position is the fix, without error, up to a delay ago; from there the measured
specific force and speed of the drive lead on, turned by the reference's own attitude. A Kalman
filter of position and velocity, the same in each axis, weighs the three with the estimator's models
(docs/vehicle-config.md). What it is off by is in the sensors or in the reference, not in matching.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cantools
import numpy as np
import numpy.typing as npt
from cantools.database.can import Database
from scipy.spatial.transform import Rotation

from accuracy_table import FROM_SECONDS, read_tum
from topoloc_import.kitti_mounting import KITTI_MOUNTING

Array = npt.NDArray[np.float64]
GRAVITY_MPS2 = np.array([0.0, 0.0, -9.81])
ACCEL_DENSITY = 0.03  # m/s^2/sqrt(Hz), the importer's
SPEED_STD_MPS, SPEED_CORRELATION_S = 0.1, 1.0
WANDER_SHARE, WANDER_LENGTH_M = 0.0075, 16.0
FIX_EVERY_S = 0.2  # every second frame
FIX_STD_M = 0.003


def read_sensors(drive: Path) -> tuple[Array, Array, Array]:
    """Specific force (n, 3), angular rate (n, 3) and speed (n) by sample."""
    database = cantools.database.load_file(drive / "topoloc_imu_wheel.dbc")
    assert isinstance(database, Database)
    rows: dict[str, dict[str, float]] = {}
    for line in (drive / "can.log").read_text().splitlines():
        stamp, _, frame = line.split()
        frame_id, payload = frame.split("#")
        decoded = database.decode_message(int(frame_id, 16), bytes.fromhex(payload), False)
        rows.setdefault(stamp, {}).update(decoded)  # type: ignore[arg-type]
    force = [[row[f"ACCEL_{axis}"] for axis in "XYZ"] for row in rows.values()]
    rate = [[row[f"RATE_{axis}"] for axis in "XYZ"] for row in rows.values()]
    return np.array(force), np.array(rate), np.array([r["REAR_LEFT"] for r in rows.values()])


class Motion:
    """Samples of a drive whose reference has a pose for each."""

    def __init__(self, drive: Path) -> None:
        reference = read_tum(drive / "ground_truth.tum")
        force, rate, speed = read_sensors(drive)
        if len(reference) != len(force):
            raise SystemExit(f"{drive}: the reference does not have a pose for each IMU sample")
        self.time_s = reference[:, 0] - reference[0, 0]
        self.position_m = reference[:, 1:4]
        self.speed_mps = speed
        attitude = Rotation.from_quat(reference[:, 4:8])
        dt_s = np.diff(self.time_s)
        middle = attitude[:-1] * Rotation.from_rotvec(0.25 * dt_s[:, None] * (rate[1:] + rate[:-1]))
        self.accel_mps2 = middle.apply(0.5 * (force[1:] + force[:-1])) + GRAVITY_MPS2
        mount = Rotation.from_euler("xyz", KITTI_MOUNTING.rotation_vehicle_imu_rpy_rad)
        ahead = np.outer(speed, [1.0, 0.0, 0.0])
        lever = np.cross(rate, KITTI_MOUNTING.wheel_reference_imu_m)
        self.velocity_mps = attitude.apply(mount.inv().apply(ahead) - lever)

    def step(self, x: Array, P: Array, k: int) -> tuple[Array, Array]:
        """State (position; velocity) of sample k and its covariance, led on to k + 1."""
        dt = self.time_s[k + 1] - self.time_s[k]
        speed = self.speed_mps[k]
        wander = WANDER_SHARE * speed * np.sqrt(2 * speed / WANDER_LENGTH_M)
        density_sq = ACCEL_DENSITY**2 + wander**2
        F = np.array([[1.0, dt], [0.0, 1.0]])
        x = F @ x + np.outer([0.5 * dt * dt, dt], self.accel_mps2[k])
        P = F @ P @ F.T + density_sq * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        share = min(1.0, dt / SPEED_CORRELATION_S)
        return update(x, P, 1, self.velocity_mps[k + 1], SPEED_STD_MPS**2 / share)


def update(x: Array, P: Array, part: int, measured: Array, variance: float) -> tuple[Array, Array]:
    """Measurement of the position (part 0) or the velocity (part 1)."""
    gain = P[:, part] / (P[part, part] + variance)
    return x + np.outer(gain, measured - x[part]), P - np.outer(gain, P[part])


def errors(motion: Motion, delay_s: float) -> Array:
    """Position error in world axes at each sample, led on over the delay."""
    n = len(motion.time_s)
    start_mps = (motion.position_m[2] - motion.position_m[0]) / motion.time_s[2]
    x, P = np.array([motion.position_m[0], start_mps]), np.diag([1e-4, 0.04])
    fixed_s = -np.inf
    result = []
    for k in range(n - 1):
        now_s = motion.time_s[k]
        if now_s - fixed_s >= FIX_EVERY_S - 0.01:
            x, P = update(x, P, 0, motion.position_m[k], FIX_STD_M**2)
            fixed_s = now_s
        last = k + int(np.searchsorted(motion.time_s[k:], now_s + delay_s - 1e-3))
        if last < n and now_s > float(FROM_SECONDS):
            y, P_y = x, P
            for j in range(k, last):
                y, P_y = motion.step(y, P_y, j)
            result.append(y[0] - motion.position_m[last])
        x, P = motion.step(x, P, k)
    return np.array(result)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="Example:\n  .venv/bin/python tools/late_limit.py --drive demo/kitti_0039\n",
    )
    parser.add_argument("--drive", type=Path, required=True, help="KITTI drive, imported")
    parser.add_argument("--delays", type=float, nargs="+", default=[0.3, 0.8], metavar="S")
    args = parser.parse_args()
    motion = Motion(args.drive)
    for delay_s in args.delays:
        off_cm = 100 * errors(motion, delay_s)
        mean = np.linalg.norm(off_cm, axis=1).mean()
        up = np.abs(off_cm[:, 2]).mean()
        print(f"{delay_s:g} s late: {mean:.1f} cm are left, {up:.1f} cm of it upwards (means)")


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Poses: KITTI's GNSS/INS rows as T_world_imu, TUM files, interpolation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from topoloc_import.errors import DriveImportError

Array = npt.NDArray[np.float64]
EARTH_RADIUS_M = 6378137.0


@dataclass(frozen=True)
class Trajectory:
    """T_world_imu over time: times [ns], positions (n, 3) and rotation matrices (n, 3, 3)."""

    time_ns: npt.NDArray[np.int64]
    position_m: Array
    rotation: Array


def mercator_trajectory(
    time_ns: npt.NDArray[np.int64], lat_lon_alt: Array, roll_pitch_yaw: Array
) -> Trajectory:
    """World axes east, north, up; origin at the first row; Mercator scaled at its latitude, and
    R = Rz(yaw) Ry(pitch) Rx(roll), as the KITTI development kit and pykitti have it."""
    lat, lon = np.radians(lat_lon_alt[:, 0]), np.radians(lat_lon_alt[:, 1])
    scale = np.cos(lat[0])
    east = scale * EARTH_RADIUS_M * lon
    north = scale * EARTH_RADIUS_M * np.log(np.tan(np.pi / 4 + lat / 2))
    position = np.stack([east, north, lat_lon_alt[:, 2]], axis=1)
    (sr, sp, sy), (cr, cp, cy) = np.sin(roll_pitch_yaw.T), np.cos(roll_pitch_yaw.T)
    rotation = np.empty((len(lat), 3, 3))
    rotation[:, 0] = np.stack([cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], axis=1)
    rotation[:, 1] = np.stack([sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], axis=1)
    rotation[:, 2] = np.stack([-sp, cp * sr, cp * cr], axis=1)
    return Trajectory(time_ns, position - position[0], rotation)


def quaternions(rotation: Array) -> Array:
    """(n, 4) Hamilton quaternions x y z w with w >= 0 of (n, 3, 3) rotations: the dominant
    eigenvector of Bar-Itzhack's matrix (well defined at every angle)."""
    r = rotation
    K = np.zeros((len(r), 4, 4))
    K[:, 0, 0] = r[:, 0, 0] - r[:, 1, 1] - r[:, 2, 2]
    K[:, 1, 1] = r[:, 1, 1] - r[:, 0, 0] - r[:, 2, 2]
    K[:, 2, 2] = r[:, 2, 2] - r[:, 0, 0] - r[:, 1, 1]
    K[:, 3, 3] = r[:, 0, 0] + r[:, 1, 1] + r[:, 2, 2]
    K[:, 1, 0] = r[:, 1, 0] + r[:, 0, 1]
    K[:, 2, 0] = r[:, 2, 0] + r[:, 0, 2]
    K[:, 2, 1] = r[:, 2, 1] + r[:, 1, 2]
    K[:, 3, 0] = r[:, 2, 1] - r[:, 1, 2]
    K[:, 3, 1] = r[:, 0, 2] - r[:, 2, 0]
    K[:, 3, 2] = r[:, 1, 0] - r[:, 0, 1]
    q: Array = np.linalg.eigh(K / 3)[1][:, :, -1]  # reads the lower triangle
    return np.where(q[:, 3:] < 0, -q, q)


def rotations(quaternion: Array) -> Array:
    """(n, 3, 3) rotations of (n, 4) unit quaternions x y z w."""
    x, y, z, w = quaternion.T
    rows = [
        np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], axis=1),
        np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], axis=1),
        np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=1),
    ]
    return np.stack(rows, axis=1)


class PoseInterpolator:
    """Poses between those of a trajectory: straight line, constant rotation rate. Just outside,
    the first or last interval's motion goes on."""

    def __init__(self, trajectory: Trajectory) -> None:
        self._time_ns = trajectory.time_ns
        self._position_m = trajectory.position_m
        q = quaternions(trajectory.rotation)
        for i in range(1, len(q)):  # neighbours on the same half of the sphere
            if q[i] @ q[i - 1] < 0:
                q[i] = -q[i]
        self._quaternion = q

    def covers(self, time_ns: int, margin_ns: int) -> bool:
        """Whether a time lies inside the trajectory or less than a margin outside."""
        first, last = int(self._time_ns[0]), int(self._time_ns[-1])
        return first - margin_ns <= time_ns <= last + margin_ns

    def at(self, time_ns: npt.NDArray[np.int64]) -> tuple[Array, Array]:
        """Positions (n, 3) and rotations (n, 3, 3)."""
        right = np.clip(np.searchsorted(self._time_ns, time_ns), 1, len(self._time_ns) - 1)
        left = right - 1
        span = (self._time_ns[right] - self._time_ns[left]).astype(np.float64)
        s = ((time_ns - self._time_ns[left]) / span)[:, None]
        position = (1 - s) * self._position_m[left] + s * self._position_m[right]
        q0, q1 = self._quaternion[left], self._quaternion[right]
        angle = np.arccos(np.clip(np.sum(q0 * q1, axis=1, keepdims=True), -1, 1))
        small = angle < 1e-6
        sine = np.where(small, 1.0, np.sin(angle))
        w0 = np.where(small, 1 - s, np.sin((1 - s) * angle) / sine)
        w1 = np.where(small, s, np.sin(s * angle) / sine)
        q = w0 * q0 + w1 * q1
        return position, rotations(q / np.linalg.norm(q, axis=1, keepdims=True))


def write_tum(path: Path, trajectory: Trajectory) -> None:
    """Lines `t tx ty tz qx qy qz qw`, times exact to the nanosecond."""
    lines = ["# timestamp[s] tx[m] ty[m] tz[m] qx qy qz qw : T_world_imu"]
    quaternion = quaternions(trajectory.rotation)
    for time_ns, p, q in zip(
        trajectory.time_ns.tolist(), trajectory.position_m, quaternion, strict=True
    ):
        numbers = " ".join(f"{v:.6f}" for v in p) + " " + " ".join(f"{v:.9f}" for v in q)
        lines.append(f"{time_ns // 10**9}.{time_ns % 10**9:09d} {numbers}")
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def read_tum(path: Path) -> Trajectory:
    """What write_tum() wrote; also stamps with fewer decimals."""
    rows = [line.split() for line in path.read_text(encoding="ascii").splitlines()]
    rows = [row for row in rows if row and not row[0].startswith("#")]
    if len(rows) < 2 or any(len(row) != 8 for row in rows):
        raise DriveImportError(f"{path}: expected two or more lines of 8 numbers")
    stamps = [row[0].partition(".") for row in rows]
    time_ns = np.array(
        [int(s) * 10**9 + int(f.ljust(9, "0")[:9] or 0) for s, _, f in stamps], dtype=np.int64
    )
    table = np.array([row[1:] for row in rows], dtype=np.float64)
    return Trajectory(time_ns, table[:, :3], rotations(table[:, 3:]))

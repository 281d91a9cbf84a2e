# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""IMU and speed samples as CAN frames in a candump log."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import cantools
from cantools.database.can import Database, Message

from topoloc_import.errors import DriveImportError

COUNTER_MODULO = 16
WHEELS = ("FRONT_LEFT", "FRONT_RIGHT", "REAR_LEFT", "REAR_RIGHT")

Axes = tuple[float, float, float]  # x, y, z


@dataclass(frozen=True)
class InertialRow:
    """What the vehicle measured at one time: IMU axes, SI units, forward speed with its sign."""

    time_ns: int
    specific_force_mps2: Axes
    angular_rate_radps: Axes
    forward_speed_mps: float


class SensorFrames:
    """Encodes samples with the shipped DBC: IMU_ACCEL and IMU_RATE of the IMU, TRAVEL_DIRECTION and
    WHEEL_SPEEDS of the wheels, the frames of a sample at the same time with the same counter."""

    def __init__(self, dbc: Path, interface: str = "can0") -> None:
        database = cantools.database.load_file(dbc, strict=True)
        if not isinstance(database, Database):
            raise DriveImportError(f"{dbc}: not a CAN database")
        self._messages: dict[str, Message] = {m.name: m for m in database.messages}
        self._interface = interface
        self._counter = 0
        self._wheel_counter = 0

    def lines(self, row: InertialRow) -> list[str]:
        """The candump lines of one row. Time stamps are rounded to candump's microseconds."""
        speed = row.forward_speed_mps
        imu = self.imu_lines(row.time_ns, row.specific_force_mps2, row.angular_rate_radps)
        return imu + self.wheel_lines(row.time_ns, speed, speed)

    def wheel_lines(self, time_ns: int, left_mps: float, right_mps: float) -> list[str]:
        """The two lines of one sample of the wheels' forward speeds with their signs; front and
        rear wheels of a side are the same. The message holds magnitudes and one direction: where
        the sides turn against each other, the mean is kept and one side reads zero."""
        n = self._wheel_counter
        self._wheel_counter = (n + 1) % COUNTER_MODULO
        total = left_mps + right_mps
        sign = -1.0 if total < 0.0 else 1.0
        left, right = sign * left_mps, sign * right_mps
        if left < 0.0 or right < 0.0:
            left, right = (abs(total), 0.0) if left > right else (0.0, abs(total))
        direction = 0 if total == 0.0 else 1 if total > 0.0 else 2
        speeds = dict(zip(WHEELS, (left, right, left, right), strict=True))
        frames: list[tuple[str, dict[str, float]]] = [
            ("TRAVEL_DIRECTION", {"DIRECTION": direction, "DIRECTION_COUNTER": n}),
            ("WHEEL_SPEEDS", {**speeds, "SPEED_COUNTER": n}),
        ]
        return [self._line(time_ns, name, signals) for name, signals in frames]

    def imu_lines(self, time_ns: int, specific_force_mps2: Axes, rate_radps: Axes) -> list[str]:
        """The two lines of one IMU sample."""
        n = self._counter
        self._counter = (n + 1) % COUNTER_MODULO
        (ax, ay, az), (wx, wy, wz) = specific_force_mps2, rate_radps
        frames: list[tuple[str, dict[str, float]]] = [
            ("IMU_ACCEL", {"ACCEL_X": ax, "ACCEL_Y": ay, "ACCEL_Z": az, "ACCEL_COUNTER": n}),
            ("IMU_RATE", {"RATE_X": wx, "RATE_Y": wy, "RATE_Z": wz, "RATE_COUNTER": n}),
        ]
        return [self._line(time_ns, name, signals) for name, signals in frames]

    def _line(self, time_ns: int, name: str, signals: dict[str, float]) -> str:
        message = self._messages[name]
        try:
            payload = message.encode(signals, strict=True)
        except cantools.database.EncodeError as error:
            raise DriveImportError(f"row at {time_ns} ns does not fit {name}: {error}") from error
        time_us = (time_ns + 500) // 1000
        seconds, micros = divmod(time_us, 1_000_000)
        stamp = f"({seconds:010d}.{micros:06d})"
        return f"{stamp} {self._interface} {message.frame_id:03X}#{payload.hex().upper()}"


def write_can_log(path: Path, dbc: Path, rows: Iterable[InertialRow]) -> None:
    """Writes a log as `candump -L` does. Rows in time order."""
    frames = SensorFrames(dbc)
    last_ns: int | None = None
    with path.open("w", encoding="ascii", newline="\n") as file:
        for row in rows:
            if last_ns is not None and row.time_ns - last_ns < 1000:
                raise DriveImportError(f"time {row.time_ns} ns does not come after {last_ns} ns")
            last_ns = row.time_ns
            file.writelines(line + "\n" for line in frames.lines(row))

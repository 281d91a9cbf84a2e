# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""LCM event log with camera frames (image_t), written byte by byte: same input, same bytes."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

# Fingerprint of lcmtypes/topoloc_image_t.lcm, which is also that of bot_core's image_t.
IMAGE_FINGERPRINT = 0x14739FFE13D5F5F0
PIXEL_FORMAT_GRAY = 1497715271
PIXEL_FORMAT_MJPEG = 1196444237
EVENT_SYNC_WORD = 0xEDA1DA01


@dataclass(frozen=True)
class CameraFrame:
    """One grey image: its bytes as GRAY rows or as one JPEG file."""

    time_ns: int  # mid-exposure
    width_px: int
    height_px: int
    pixel_format: int
    data: bytes

    @property
    def time_us(self) -> int:
        """LCM's time unit, rounded."""
        return (self.time_ns + 500) // 1000


def encode_image(frame: CameraFrame) -> bytes:
    """The frame as an encoded image_t message, without metadata."""
    header = struct.pack(
        ">Qqiiiii",
        IMAGE_FINGERPRINT,
        frame.time_us,
        frame.width_px,
        frame.height_px,
        frame.width_px,  # row stride
        frame.pixel_format,
        len(frame.data),
    )
    return header + frame.data + struct.pack(">i", 0)


class CameraLog:
    """An event log that lcm-logplayer plays: each frame is logged at its own time stamp."""

    def __init__(self, path: Path, channel: str) -> None:
        self._file = path.open("wb")
        self._channel = channel.encode("ascii")
        self._events = 0

    def write(self, frame: CameraFrame) -> None:
        """Appends one frame."""
        message = encode_image(frame)
        self._file.write(
            struct.pack(
                ">IqqII",
                EVENT_SYNC_WORD,
                self._events,
                frame.time_us,
                len(self._channel),
                len(message),
            )
        )
        self._file.write(self._channel)
        self._file.write(message)
        self._events += 1

    def __enter__(self) -> CameraLog:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.close()

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""LCM event log with camera frames (image_t), written byte by byte: same input, same bytes."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import lcm

from topoloc_import.errors import DriveImportError

# Fingerprint of lcmtypes/topoloc_image_t.lcm, which is also that of bot_core's image_t.
IMAGE_FINGERPRINT = 0x14739FFE13D5F5F0
PIXEL_FORMAT_GRAY = 1497715271
PIXEL_FORMAT_MJPEG = 1196444237
EVENT_SYNC_WORD = 0xEDA1DA01
IMAGE_HEADER = struct.Struct(">Qqiiiii")  # fingerprint, us, width, height, stride, format, bytes


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
    header = IMAGE_HEADER.pack(
        IMAGE_FINGERPRINT,
        frame.time_us,
        frame.width_px,
        frame.height_px,
        frame.width_px,  # row stride
        frame.pixel_format,
        len(frame.data),
    )
    return header + frame.data + struct.pack(">i", 0)


def decode_image(message: bytes) -> CameraFrame:
    """What encode_image() was given; time in whole microseconds."""
    header = IMAGE_HEADER.size
    if len(message) < header:
        raise DriveImportError("an image message ends early")
    fingerprint, time_us, width, height, stride, pixel_format, size = IMAGE_HEADER.unpack(
        message[:header]
    )
    if fingerprint != IMAGE_FINGERPRINT or stride != width or len(message) < header + size:
        raise DriveImportError("a message is no image that the importers write")
    return CameraFrame(time_us * 1000, width, height, pixel_format, message[header : header + size])


def read_frames(path: Path, channel: str) -> Iterator[CameraFrame]:
    """The images of a log that CameraLog wrote."""
    for event in lcm.EventLog(str(path)):
        if event.channel == channel:
            yield decode_image(event.data)


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

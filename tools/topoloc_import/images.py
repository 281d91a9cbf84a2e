# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Image files as camera frames."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from topoloc_import.errors import DriveImportError
from topoloc_import.lcm_log import PIXEL_FORMAT_GRAY, PIXEL_FORMAT_MJPEG, CameraFrame


def jpeg_frame(path: Path, time_ns: int) -> CameraFrame:
    """A JPEG file, not encoded anew; it is decoded once to know that it can be."""
    image = _load(path)
    if image.format != "JPEG":
        raise DriveImportError(f"{path}: not a JPEG file")
    return CameraFrame(time_ns, image.width, image.height, PIXEL_FORMAT_MJPEG, path.read_bytes())


def grey_frame(path: Path, time_ns: int) -> CameraFrame:
    """A grey PNG (or other lossless) file as rows of bytes."""
    image = _load(path)
    if image.mode != "L":
        raise DriveImportError(f"{path}: expected an 8-bit grey image, found mode {image.mode}")
    return CameraFrame(time_ns, image.width, image.height, PIXEL_FORMAT_GRAY, image.tobytes())


def _load(path: Path) -> Image.Image:
    try:
        image = Image.open(path)
        image.load()
    except (OSError, ValueError, SyntaxError) as error:
        raise DriveImportError(f"{path}: {error}") from error
    return image

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Image files as camera frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
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


def any_grey_frame(path: Path, time_ns: int) -> CameraFrame:
    """An 8-bit image of any format as rows of grey; colours are weighed as Pillow does."""
    image = _load(path)
    if image.mode not in ("L", "RGB", "RGBA", "P"):
        raise DriveImportError(f"{path}: expected an 8-bit image, found mode {image.mode}")
    grey = image.convert("L")
    return CameraFrame(time_ns, grey.width, grey.height, PIXEL_FORMAT_GRAY, grey.tobytes())


def mosaic_frame(path: Path, time_ns: int) -> CameraFrame:
    """A PNG file with the raw colour mosaic (Bayer pattern) of a camera, turned to grey. A colour
    image is no mosaic any more: turned to grey as Pillow does."""
    image = _load(path)
    if image.mode == "RGB":
        grey = image.convert("L").tobytes()
    elif image.mode == "L" and min(image.size) >= 2:
        grey = grey_of_mosaic(np.asarray(image)).tobytes()
    else:
        raise DriveImportError(f"{path}: expected an 8-bit image, found mode {image.mode}")
    return CameraFrame(time_ns, image.width, image.height, PIXEL_FORMAT_GRAY, grey)


def grey_of_mosaic(mosaic: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Grey (R + 2 G + B) / 4 of a Bayer mosaic after bilinear interpolation of its colours. With
    these weights that is one 3x3 binomial filter, the same for all four Bayer patterns, and it
    moves nothing. At the border pixels are mirrored, which keeps the pattern."""
    padded = np.pad(mosaic.astype(np.uint16), 1, mode="reflect")
    rows = padded[:, :-2] + 2 * padded[:, 1:-1] + padded[:, 2:]
    total = rows[:-2] + 2 * rows[1:-1] + rows[2:]
    grey: npt.NDArray[np.uint8] = ((total + 8) // 16).astype(np.uint8)
    return grey


def _load(path: Path) -> Image.Image:
    try:
        image = Image.open(path)
        image.load()
    except (OSError, ValueError, SyntaxError) as error:
        raise DriveImportError(f"{path}: {error}") from error
    return image

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Images to check the exported graphs on: a drawn street-like scene, and its view after a warp."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFilter

Grey = NDArray[np.float32]


def drawn_scene(width_px: int, height_px: int, seed: int = 1) -> Image.Image:
    """Overlapping boxes, lines and discs on a gradient, slightly blurred and noisy."""
    rng = np.random.default_rng(seed)
    gradient = np.linspace(90, 160, height_px)[:, None] * np.ones(width_px)
    image = Image.fromarray(gradient.astype(np.uint8))
    draw = ImageDraw.Draw(image)
    for _ in range(width_px * height_px // 600):
        x, y = rng.uniform(0, width_px), rng.uniform(0, height_px)
        w, h = rng.uniform(4, 50, 2)
        shade = int(rng.integers(10, 246))
        shape = rng.integers(3)
        if shape == 0:
            draw.rectangle((x, y, x + w, y + h), fill=shade)
        elif shape == 1:
            draw.ellipse((x, y, x + w, y + h), fill=shade)
        else:
            draw.line((x, y, x + w, y + h), fill=shade, width=int(rng.integers(1, 5)))
    smooth = np.asarray(image.filter(ImageFilter.GaussianBlur(0.7)), dtype=np.float64)
    noisy = smooth + rng.normal(0.0, 1.5, smooth.shape)
    return Image.fromarray(noisy.clip(0, 255).astype(np.uint8))


def photo(path: Path, width_px: int, height_px: int) -> Image.Image:
    """The largest centred crop of the file's image in the wanted shape, scaled to size."""
    image = Image.open(path).convert("L")
    scale = min(image.width / width_px, image.height / height_px)
    w, h = width_px * scale, height_px * scale
    left, top = (image.width - w) / 2, (image.height - h) / 2
    return image.resize(
        (width_px, height_px), Image.Resampling.BICUBIC, (left, top, left + w, top + h)
    )


def warped(image: Image.Image, homography: NDArray[np.float64]) -> Image.Image:
    """The image seen after `homography` (source pixel to warped pixel, centres at integers)."""
    inverse = np.linalg.inv(homography)
    # Pillow's coordinates have pixel centres at half-integers.
    shift = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1]])
    coefficients = shift @ inverse @ np.linalg.inv(shift)
    return image.transform(
        image.size,
        Image.Transform.PERSPECTIVE,
        list((coefficients / coefficients[2, 2]).flatten()[:8]),
        Image.Resampling.BICUBIC,
    )


def as_tensor(image: Image.Image) -> Grey:
    """[1,1,H,W] float32, 0..255."""
    return np.asarray(image, dtype=np.float32)[None, None]

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Peaks of a score map: where exactly they are."""

import torch
from torch import Tensor


def vertices(surface: Tensor, index: Tensor, width_px: int, height_px: int) -> Tensor:
    """Peaks to sub-pixel: the vertex of a parabola through the surface, along each axis.

    surface [H*W], index [N] of the peaks in it -> [N,2] x, y in pixels, at most half a pixel off.
    """
    row = torch.div(index, width_px, rounding_mode="floor")
    column = index - row * width_px
    centre = surface[index]

    def vertex(before: Tensor, after: Tensor) -> Tensor:
        low, high = surface[before], surface[after]
        curvature = (2.0 * centre - low - high).clamp(min=1e-6)
        return (0.5 * (high - low) / curvature).clamp(-0.5, 0.5)

    along_x = vertex(
        row * width_px + (column - 1).clamp(min=0),
        row * width_px + (column + 1).clamp(max=width_px - 1),
    )
    along_y = vertex(
        (row - 1).clamp(min=0) * width_px + column,
        (row + 1).clamp(max=height_px - 1) * width_px + column,
    )
    return torch.stack([column + along_x, row + along_y], -1)

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Where a localiser starts in the demo and in the suite."""

from __future__ import annotations

from pathlib import Path

import numpy as np

INITIAL_ERROR_M = (0.8, -0.6, 0.0)
INITIAL_YAW_ERROR_DEG = 3.0


def first_pose(trajectory: Path) -> tuple[float, ...]:
    """x y z qx qy qz qw of a TUM file's first row."""
    with trajectory.open() as lines:
        for line in lines:
            if line.strip() and not line.startswith("#"):
                return tuple(float(v) for v in line.split()[1:])
    raise ValueError(f"{trajectory}: no poses")


def start_pose(trajectory: Path, disturbed: bool) -> str:
    """First pose of a TUM file, moved by 1 m and turned by 3 degrees if `disturbed`:
    "x y z qx qy qz qw"."""
    x, y, z, qx, qy, qz, qw = first_pose(trajectory)
    if not disturbed:
        return " ".join(f"{v:.9f}" for v in (x, y, z, qx, qy, qz, qw))
    half = np.radians(INITIAL_YAW_ERROR_DEG) / 2.0
    s, c = np.sin(half), np.cos(half)
    # q times a turn about the body's z axis.
    quaternion = (qx * c + qy * s, qy * c - qx * s, qz * c + qw * s, qw * c - qz * s)
    position = (a + b for a, b in zip((x, y, z), INITIAL_ERROR_M, strict=True))
    return " ".join(f"{v:.9f}" for v in (*position, *quaternion))

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""What has to be put right in KITTI's GNSS/INS rows before they can serve as an IMU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from topoloc_import.can_log import InertialRow

# The angular rates of a row are low-pass filtered and describe the vehicle this much before the
# row's time; pose, velocity and accelerations do not lag. The same on all KITTI drives, to 5 ms:
# tools/oxts_noise.py measures it (median over 20 drives other than 0039 and 0009).
RATE_LAG_NS = 55_000_000


def undo_rate_lag(rows: Sequence[InertialRow]) -> list[InertialRow]:
    """Rows with the rates of their own time: those of RATE_LAG_NS later, interpolated. The last
    rows, for which there is nothing later, keep the newest rates there are."""
    start_ns = rows[0].time_ns
    time_s = np.array([row.time_ns - start_ns for row in rows]) * 1e-9
    rates = np.array([row.angular_rate_radps for row in rows])
    wanted_s = time_s + RATE_LAG_NS * 1e-9
    aligned = np.stack([np.interp(wanted_s, time_s, rates[:, axis]) for axis in range(3)], axis=1)
    return [
        replace(row, angular_rate_radps=(rate[0], rate[1], rate[2]))
        for row, rate in zip(rows, aligned.tolist(), strict=True)
    ]

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""How much the angular rates of KITTI's GNSS/INS rows lag behind their attitude, and how noisy
rates and accelerations are as an IMU that is sampled like these rows.

For each drive and axis, the rate is shifted in time until its mean over each interval fits the
attitude's change best; accelerations likewise against the velocity's change.
"""

from __future__ import annotations

import argparse
import gzip
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

Array = npt.NDArray[np.float64]
GRAVITY_MPS2 = 9.81
SHIFTS_S = np.arange(-0.05, 0.1501, 0.005)


def read_drive(path: Path) -> dict[str, Array]:
    with gzip.open(path, "rt") as file:
        table = np.genfromtxt(file, delimiter=",", names=True)
    return {name: table[name] for name in table.dtype.names or ()}


def changes(rows: dict[str, Array]) -> tuple[Array, Array, Array, Array, Array]:
    """Times, interval lengths, body rates and specific force that the poses imply per interval."""
    time_s = (rows["timestamp_ns"] - rows["timestamp_ns"][0]) * 1e-9
    dt_s = np.diff(time_s)
    attitude = Rotation.from_euler(
        "ZYX", np.column_stack([rows["yaw_rad"], rows["pitch_rad"], rows["roll_rad"]])
    )
    rates = (attitude[:-1].inv() * attitude[1:]).as_rotvec() / dt_s[:, None]
    c, s = np.cos(rows["yaw_rad"]), np.sin(rows["yaw_rad"])
    # vf and vl are level; vl counts to the right in these files (docs/calibration.md).
    forward, right, up = rows["vf_mps"], rows["vl_mps"], rows["vu_mps"]
    velocity = np.column_stack([c * forward + s * right, s * forward - c * right, up])
    force = np.diff(velocity, axis=0) / dt_s[:, None]
    force[:, 2] += GRAVITY_MPS2
    return time_s, dt_s, rates, attitude[:-1].inv().apply(force), 0.5 * (time_s[1:] + time_s[:-1])


def best_shift(
    time_s: Array, dt_s: Array, middle_s: Array, implied: Array, measured: Array
) -> tuple[float, float]:
    """Shift [s] with the smallest residual, and the residual's density [unit/sqrt(Hz)] there."""
    spline = CubicSpline(time_s, measured)
    inside = (
        (middle_s > time_s[0] + 0.2) & (middle_s < time_s[-1] - 0.2) & (dt_s > 0.02) & (dt_s < 0.13)
    )
    residuals = []
    for shift in SHIFTS_S:
        mean = np.mean([spline(middle_s + shift + f * dt_s) for f in (-1 / 3, 0, 1 / 3)], axis=0)
        r = (implied - mean)[inside]
        residuals.append(float(np.sqrt(np.mean((r - np.median(r)) ** 2))))
    best = int(np.argmin(residuals))
    return float(SHIFTS_S[best]), residuals[best] * float(np.sqrt(np.median(dt_s)))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="Example:\n  tools/oxts_rate_lag.py ../shared/data/kitti_oxts/*.csv.gz\n",
    )
    parser.add_argument("drives", nargs="+", type=Path, help="OXTS tables (.csv.gz)")
    parser.add_argument(
        "--exclude",
        nargs="*",
        default=["0009", "0039", "0093"],
        help="drive numbers to leave out (default: %(default)s)",
    )
    args = parser.parse_args()
    axes = ("wx", "wy", "wz", "ax", "ay", "az")
    columns = [f"{a}_radps" if a[0] == "w" else f"{a}_mps2" for a in axes]
    table = []
    print("drive                  " + "".join(f"{a:>18}" for a in axes))
    for path in args.drives:
        if any(path.name.split(".")[0].endswith(number) for number in args.exclude):
            continue
        rows = read_drive(path)
        time_s, dt_s, rates, force, middle_s = changes(rows)
        implied = np.column_stack([rates, force])
        figures = [
            best_shift(time_s, dt_s, middle_s, implied[:, i], rows[c])
            for i, c in enumerate(columns)
        ]
        table.append(figures)
        print(
            f"{path.name.split('.')[0]:<23}"
            + "".join(f"{1e3 * shift:6.0f} ms {density:8.4f}" for shift, density in figures)
        )
    median = np.median(np.array(table), axis=0)
    print(f"{'median':<23}" + "".join(f"{1e3 * s:6.0f} ms {d:8.4f}" for s, d in median))


if __name__ == "__main__":
    main()

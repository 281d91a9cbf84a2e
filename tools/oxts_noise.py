#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""How much the angular rates of KITTI's GNSS/INS rows lag behind their attitude, how noisy and
biased rates and accelerations are as an IMU that is sampled like these rows, and how far ways by
speed and attitude are from ways by position.

For each drive and axis, the rate is shifted in time until its mean over each interval fits the
attitude's change best; accelerations likewise against the velocity's change. Then, for stretches of
the way: its direction in the vehicle's axes and its length against the integrated speed. The errors
of position that this shows are those of any cloud that was put together with such poses. Last, the
Gauss-Markov drift along the way that explains them at all lengths: estimator.map_wander.
"""

from __future__ import annotations

import argparse
import gzip
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from topoloc_import.trajectory import mercator_trajectory

Array = npt.NDArray[np.float64]
GRAVITY_MPS2 = 9.81
STRETCHES_M = (2.5, 5.0, 10.0, 20.0, 40.0, 80.0)
SHOWN_STRETCH_M = 20.0
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
) -> tuple[float, float, float]:
    """Shift [s] with the smallest residual, the residual's density [unit/sqrt(Hz)] there, and its
    mean [unit]: the bias."""
    spline = CubicSpline(time_s, measured)
    inside = (
        (middle_s > time_s[0] + 0.2) & (middle_s < time_s[-1] - 0.2) & (dt_s > 0.02) & (dt_s < 0.13)
    )
    residuals = []
    biases = []
    for shift in SHIFTS_S:
        mean = np.mean([spline(middle_s + shift + f * dt_s) for f in (-1 / 3, 0, 1 / 3)], axis=0)
        r = (implied - mean)[inside]
        biases.append(-float(np.mean(r)))
        residuals.append(float(np.sqrt(np.mean((r - np.median(r)) ** 2))))
    best = int(np.argmin(residuals))
    return float(SHIFTS_S[best]), residuals[best] * float(np.sqrt(np.median(dt_s))), biases[best]


def way_spread(rows: dict[str, Array], stretch_m: float) -> tuple[float, float, float]:
    """Robust standard deviation over stretches, around the drive's own median, of the way by
    position against the way by speed and attitude: sideways, up and along, as shares of the way."""
    place = np.column_stack([rows["lat_deg"], rows["lon_deg"], rows["alt_m"]])
    angles = np.column_stack([rows["roll_rad"], rows["pitch_rad"], rows["yaw_rad"]])
    driven = mercator_trajectory(rows["timestamp_ns"].astype(np.int64), place, angles)
    attitude = Rotation.from_matrix(driven.rotation)
    half = Rotation.from_rotvec(0.5 * (attitude[:-1].inv() * attitude[1:]).as_rotvec())
    steps = (attitude[:-1] * half).inv().apply(np.diff(driven.position_m, axis=0))
    speed = 0.5 * (rows["vf_mps"][1:] + rows["vf_mps"][:-1])
    lengths = speed * np.diff(rows["timestamp_ns"]) * 1e-9
    number = (np.cumsum(lengths) / stretch_m).astype(int)
    shares = []
    for i in np.unique(number):
        way, length = steps[number == i].sum(axis=0), lengths[number == i].sum()
        if way[0] > 0.8 * stretch_m:
            shares.append([way[1] / way[0], way[2] / way[0], way[0] / length])
    if not shares:
        return float("nan"), float("nan"), float("nan")
    spread = np.median(np.abs(shares - np.median(shares, axis=0)), axis=0) * 1.4826
    return float(spread[0]), float(spread[1]), float(spread[2])


def wander(spreads: Array) -> tuple[float, float]:
    """Share and length [m] of the Gauss-Markov drift whose means over STRETCHES_M spread so."""

    def spread_of_mean(log_model: Array) -> Array:
        share, length_m = np.exp(log_model)
        x = np.array(STRETCHES_M) / length_m
        spread: Array = share * np.sqrt(2 * (x - 1 + np.exp(-x))) / x
        return spread

    fit = least_squares(lambda m: np.log(spread_of_mean(m) / spreads), np.log([0.01, 10.0]))
    share, length_m = np.exp(fit.x)
    return float(share), float(length_m)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="Example:\n  .venv/bin/python tools/oxts_noise.py path/to/kitti_oxts/*.csv.gz\n",
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
    spreads: list[list[tuple[float, float, float]]] = []
    names = []
    print("Lag, noise density [unit/sqrt(Hz)], bias [unit]")
    print("drive                  " + "".join(f"{a:>25}" for a in axes))
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
            + "".join(f"{1e3 * s:6.0f} ms {d:7.4f} {b:8.4f}" for s, d, b in figures)
        )
        spreads.append([way_spread(rows, stretch_m) for stretch_m in STRETCHES_M])
        names.append(path.name.split(".")[0])
    median = np.median(np.array(table), axis=0)
    print(f"{'median':<23}" + "".join(f"{1e3 * s:6.0f} ms {d:7.4f} {b:8.4f}" for s, d, b in median))
    by_stretch = np.array(spreads)  # drive, stretch, axis
    shown = STRETCHES_M.index(SHOWN_STRETCH_M)
    print(f"\nSpread of ways of {SHOWN_STRETCH_M:.0f} m [%]: sideways, up, along")
    for name, spread in zip(names, by_stretch[:, shown], strict=True):
        print(f"{name:<23}" + "".join(f"{100 * s:8.2f}" for s in spread))
    print("\nMedian over the drives, by length of the stretch [m]")
    middle = np.nanmedian(by_stretch, axis=0)
    for stretch_m, spread in zip(STRETCHES_M, middle, strict=True):
        print(f"{stretch_m:<23}" + "".join(f"{100 * s:8.2f}" for s in spread))
    share, length_m = wander(np.sqrt(np.mean(middle**2, axis=1)))
    print(f"Drift that explains them: {100 * share:.2f} % of the way, lasting {length_m:.0f} m")


if __name__ == "__main__":
    main()

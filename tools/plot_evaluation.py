#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Plots of the errors.csv that topoloc-evaluate --plots writes.

trajectory.png     seen from above, coloured by position error
errors.png         longitudinal, lateral, vertical and attitude errors over time
distribution.png   share of poses below an error
"""

from __future__ import annotations

import argparse
import csv
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

Array = NDArray[np.float64]

EXAMPLES = """examples:
  topoloc-evaluate --reference ground_truth.tum --estimate est.tum --plots plots
  .venv/bin/python tools/plot_evaluation.py plots/errors.csv --out plots
"""

AXES = [
    # column, standard deviation, title, factor, unit
    ("longitudinal_m", "longitudinal_std_m", "longitudinal", 1.0, "m"),
    ("lateral_m", "lateral_std_m", "lateral", 1.0, "m"),
    ("vertical_m", "vertical_std_m", "vertical", 1.0, "m"),
    ("roll_rad", "roll_std_rad", "about IMU x", 180.0 / np.pi, "deg"),
    ("pitch_rad", "pitch_std_rad", "about IMU y", 180.0 / np.pi, "deg"),
    ("yaw_rad", "yaw_std_rad", "about IMU z", 180.0 / np.pi, "deg"),
]


@dataclass(frozen=True)
class Errors:
    """Errors of one estimate, a column of the CSV each; NaN where the CSV is empty."""

    label: str
    time_s: Array  # from the first row of all estimates
    columns: dict[str, Array]

    def __getitem__(self, name: str) -> Array:
        return self.columns[name]

    def position_m(self) -> Array:
        return np.sqrt(sum(self[axis] ** 2 for axis, *_ in AXES[:3]))

    def rotation_rad(self) -> Array:
        return np.sqrt(sum(self[axis] ** 2 for axis, *_ in AXES[3:]))


def read_errors(path: Path) -> list[Errors]:
    """Reads the CSV, one entry per label in the file's order."""
    rows: dict[str, list[dict[str, str]]] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            rows.setdefault(row["label"], []).append(row)
    if not rows:
        raise ValueError(f"{path}: no rows")
    begin_ns = min(int(group[0]["time_ns"]) for group in rows.values())
    return [
        Errors(
            label=label,
            time_s=np.array([(int(row["time_ns"]) - begin_ns) * 1e-9 for row in group]),
            columns={
                name: np.array([float(row[name] or "nan") for row in group])
                for name in group[0]
                if name not in ("label", "time_ns")
            },
        )
        for label, group in rows.items()
    ]


def plot_trajectory(errors: list[Errors], path: Path) -> None:
    """One panel per estimate: the reference in grey, the estimate coloured by its error."""
    reference = errors[0]
    extent = np.ptp(reference["reference_x_m"]), np.ptp(reference["reference_y_m"])
    tall = extent[1] > 1.3 * extent[0]
    n = len(errors)
    shape = (1, n) if tall else (n, 1)
    size = (5.0 * n + 1.0, 8.0) if tall else (10.0, 4.5 * n + 0.5)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(*shape, squeeze=False)
    limit = max(float(np.percentile(one.position_m(), 98.0)) for one in errors)
    for axis, one in zip(axes.flat, errors, strict=True):
        x0, y0 = one["reference_x_m"][0], one["reference_y_m"][0]
        axis.plot(
            one["reference_x_m"] - x0,
            one["reference_y_m"] - y0,
            color="0.75",
            linewidth=6.0,
            solid_capstyle="round",
            label="reference",
            zorder=1,
        )
        points = axis.scatter(
            one["estimate_x_m"] - x0,
            one["estimate_y_m"] - y0,
            c=one.position_m(),
            s=7.0,
            cmap="viridis",
            vmin=0.0,
            vmax=max(limit, 1e-6),
            label="estimate",
            zorder=2,
        )
        axis.plot(0.0, 0.0, marker="o", color="tab:red", markersize=8.0, label="start", zorder=3)
        axis.set_aspect("equal", adjustable="datalim")
        axis.set_xlabel("x from the start [m]")
        axis.set_ylabel("y from the start [m]")
        axis.set_title(f"{one.label}: APEt {np.mean(one.position_m()):.3f} m")
        axis.grid(alpha=0.3)
        axis.legend(loc="best")
        figure.colorbar(points, ax=axis, label="position error [m]", extend="max")
    figure.savefig(path, dpi=130)


def plot_over_time(errors: list[Errors], path: Path) -> None:
    """Six errors over time; with one estimate also its own 3-sigma bands."""
    figure = Figure(figsize=(13.0, 8.0), layout="constrained")
    axes = figure.subplots(3, 2, sharex=True)
    for axis, (name, std_name, title, factor, unit) in zip(axes.T.flat, AXES, strict=True):
        for one in errors:
            value = one[name] * factor
            axis.plot(one.time_s, value, linewidth=1.0, label=one.label)
            if len(errors) > 1:
                continue
            band = 3.0 * one[std_name] * factor
            if np.any(np.isfinite(band)):
                axis.fill_between(
                    one.time_s, -band, band, color="tab:blue", alpha=0.15, label="its own 3 sigma"
                )
                visible = max(3.0 * np.percentile(np.abs(value), 95), np.max(np.abs(value)))
                high = min(np.nanmax(band), 3.0 * visible)
                axis.set_ylim(-1.1 * max(high, visible), 1.1 * max(high, visible))
        axis.axhline(0.0, color="0.4", linewidth=0.8)
        axis.set_ylabel(f"{title} [{unit}]")
        axis.grid(alpha=0.3)
    axes[0, 0].set_title("position error in the true heading")
    axes[0, 1].set_title("attitude error")
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    axes[0, 0].legend(loc="upper right")
    figure.savefig(path, dpi=130)


def plot_distribution(errors: list[Errors], path: Path) -> None:
    """Cumulative distributions of position and rotation error."""
    figure = Figure(figsize=(12.0, 4.5), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for axis, title in zip(axes, ("position error [m]", "rotation error [deg]"), strict=True):
        for one in errors:
            position = title.startswith("position")
            value = one.position_m() if position else np.degrees(one.rotation_rad())
            value = np.sort(value)
            share = np.arange(1, len(value) + 1) / len(value) * 100.0
            figures = f"median {np.median(value):.3f}, 95 % {np.percentile(value, 95):.3f}"
            axis.step(value, share, where="post", label=f"{one.label} ({figures})")
        for level in (50.0, 95.0):
            axis.axhline(level, color="0.6", linewidth=0.8, linestyle=":")
        axis.set_xlabel(title)
        axis.set_xlim(left=0.0)
        axis.set_ylim(0.0, 101.0)
        axis.grid(alpha=0.3)
        axis.legend(loc="lower right")
    axes[0].set_ylabel("poses below [%]")
    figure.savefig(path, dpi=130)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("errors", type=Path, help="errors.csv of topoloc-evaluate")
    parser.add_argument("--out", type=Path, required=True, help="folder for the PNG files")
    args = parser.parse_args()
    try:
        errors = read_errors(args.errors)
        args.out.mkdir(parents=True, exist_ok=True)
        plot_trajectory(errors, args.out / "trajectory.png")
        plot_over_time(errors, args.out / "errors.png")
        plot_distribution(errors, args.out / "distribution.png")
    except (OSError, ValueError, KeyError) as error:
        print(f"plot_evaluation.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

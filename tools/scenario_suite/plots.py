# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Plots as SVG that goes into a page: text in the page's font and colour, no background."""

from __future__ import annotations

import csv
import hashlib
import io
import re
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Drawn in this, shown in the page's own colour.
INK = "#010203"
COLOURS = ("#3a86d4", "#e08a1e", "#2f9e6e", "#d1495b", "#9467bd", "#8c7a5b", "#17a2b8", "#888888")
MOST_POINTS = 700
BESIDE_M = 10.0  # of the truth, as seen from above


@dataclass(frozen=True)
class Curve:
    """Errors of a run over time."""

    label: str
    colour: str
    time_s: Array
    columns: dict[str, Array]

    def __getitem__(self, name: str) -> Array:
        return self.columns[name]

    @property
    def position_m(self) -> Array:
        axes = ("longitudinal_m", "lateral_m", "vertical_m")
        return np.sqrt(sum((self[axis] ** 2 for axis in axes), np.zeros_like(self.time_s)))


def read_curve(path: Path, label: str, colour: str) -> Curve | None:
    """Reads what topoloc-evaluate --errors wrote; None where there is nothing."""
    try:
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
    except OSError:
        return None
    if not rows:
        return None
    begin_ns = int(rows[0]["time_ns"])
    return Curve(
        label,
        colour,
        np.array([(int(row["time_ns"]) - begin_ns) * 1e-9 for row in rows]),
        {
            name: np.array([float(row[name] or "nan") for row in rows])
            for name in rows[0]
            if name not in ("label", "time_ns")
        },
    )


def thinned(x: Array, y: Array) -> tuple[Array, Array]:
    """A few hundred points with the largest of those between, so that no peak is lost."""
    step = max(1, len(x) // MOST_POINTS)
    starts = range(0, len(x), step)
    best = [i + int(np.nanargmax(np.abs(y[i : i + step])))
            if np.isfinite(y[i : i + step]).any() else i for i in starts]  # fmt: skip
    return x[best], y[best]


def figure(width: float, height: float, rows: int = 1) -> tuple[Figure, list[mpl.axes.Axes]]:
    mpl.rc("svg", fonttype="none")
    mpl.rc("font", size=9)
    mpl.rc("axes", linewidth=0.7, labelcolor=INK, edgecolor=INK)
    mpl.rc("text", color=INK)
    mpl.rc("xtick", color=INK)
    mpl.rc("ytick", color=INK)
    drawing = Figure(figsize=(width, height), layout="constrained")
    drawing.patch.set_alpha(0.0)
    axes = [drawing.add_subplot(rows, 1, i + 1) for i in range(rows)]
    for ax in axes:
        ax.patch.set_alpha(0.0)
        ax.grid(color="#888888", alpha=0.25, linewidth=0.6)
        for side in ("top", "right"):
            ax.spines[side].set_visible(False)
    return drawing, axes


def legend(ax: mpl.axes.Axes, columns: int) -> None:
    """Above the plot: nothing is hidden."""
    ax.legend(
        frameon=False, fontsize=8, labelcolor=INK, ncols=columns, loc="lower left",
        bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, columnspacing=1.2, handlelength=1.4,
    )  # fmt: skip


def svg(drawing: Figure, title: str) -> str:
    """As text to put into a page; ids are the drawing's own, so that several fit in one page."""
    buffer = io.StringIO()
    mpl.rcParams["svg.hashsalt"] = title
    drawing.savefig(
        buffer, format="svg", metadata={"Date": None, "Creator": None}, transparent=True
    )
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    prefix = "p" + hashlib.sha256(title.encode()).hexdigest()[:8] + "-"
    text = re.sub(r'\bid="', f'id="{prefix}', text)
    text = re.sub(r"url\(#", f"url(#{prefix}", text)
    text = re.sub(r'href="#', f'href="#{prefix}', text)
    text = text.replace(INK, "currentColor")
    # The page's font; the size stays.
    text = re.sub(r"font: ([\d.]+px)[^;\"]*", r"font-size: \1", text)
    text = re.sub(r"<svg ", f'<svg role="img" aria-label="{title}" ', text, count=1)
    text = re.sub(r' (width|height)="[\d.]+pt"', "", text, count=2)
    return re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.S)


def colour(i: int) -> str:
    return COLOURS[i % len(COLOURS)]


def trajectories(title: str, curves: list[Curve], nodes: Array | None) -> str:
    """Seen from above; the truth in the page's colour."""
    drawing, (ax,) = figure(5.2, 4.2)
    reference = curves[0]
    x, y = reference["reference_x_m"], reference["reference_y_m"]
    ax.plot(x[::5], y[::5], color=INK, linewidth=3.0, alpha=0.3, label="truth")
    for curve in curves:
        step = max(1, len(curve.time_s) // MOST_POINTS)
        ax.plot(
            curve["estimate_x_m"][::step],
            curve["estimate_y_m"][::step],
            color=curve.colour, linewidth=1.0, label=curve.label,
        )  # fmt: skip
    if nodes is not None and len(nodes):
        ax.plot(nodes[:, 0], nodes[:, 1], ".", color=INK, markersize=2.0, label="map nodes")
    # What gets lost may be far away, and would make a dot of all others. `auto`, for the aspect
    # widens them.
    ax.set_xlim(x.min() - BESIDE_M, x.max() + BESIDE_M, auto=True)
    ax.set_ylim(y.min() - BESIDE_M, y.max() + BESIDE_M, auto=True)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    legend(ax, 3)
    return svg(drawing, title)


def error_over_time(title: str, curves: list[Curve]) -> str:
    drawing, (ax,) = figure(10.6, 3.4)
    for curve in curves:
        x, y = thinned(curve.time_s, np.maximum(curve.position_m, 1e-3))
        ax.plot(x, y, color=curve.colour, linewidth=1.0, label=curve.label)
    ax.set_yscale("log")
    ax.set_xlabel("time [s]")
    ax.set_ylabel("position error [m]")
    legend(ax, 6)
    return svg(drawing, title)


def distribution(title: str, curves: list[Curve]) -> str:
    drawing, (ax,) = figure(5.2, 4.2)
    for curve in curves:
        values = np.sort(curve.position_m[np.isfinite(curve.position_m)])
        if not len(values):
            continue
        at = np.unique(np.linspace(0, len(values) - 1, 200).astype(int))
        ax.plot(
            np.maximum(values[at], 1e-3), (at + 1) / len(values),
            color=curve.colour, linewidth=1.2, label=curve.label,
        )  # fmt: skip
    ax.set_xscale("log")
    ax.set_ylim(0.0, 1.0)
    ax.set_xlabel("position error [m]")
    ax.set_ylabel("share of the poses below")
    legend(ax, 3)
    return svg(drawing, title)


def along_and_across(title: str, curves: list[Curve]) -> str:
    """Signed errors with three standard deviations of the first one's own."""
    axes_names = (("longitudinal_m", "longitudinal_std_m"), ("lateral_m", "lateral_std_m"))
    drawing, axes = figure(10.6, 4.6, rows=2)
    for ax, (name, std_name) in zip(axes, axes_names, strict=True):
        first = curves[0]
        step = max(1, len(first.time_s) // MOST_POINTS)
        band = 3.0 * first[std_name][::step]
        if np.isfinite(band).any():
            ax.fill_between(
                first.time_s[::step], -band, band, color=first.colour, alpha=0.15, linewidth=0,
                label="3 standard deviations",
            )  # fmt: skip
        for curve in curves:
            x, y = thinned(curve.time_s, curve[name])
            ax.plot(x, y, color=curve.colour, linewidth=1.0, label=curve.label)
        ax.set_ylabel(f"{name.removesuffix('_m')} [m]")
    axes[-1].set_xlabel("time [s]")
    legend(axes[0], 6)
    return svg(drawing, title)


def node_errors(title: str, curves: list[Curve]) -> str:
    """Position errors of maps' nodes along the way."""
    drawing, (ax,) = figure(10.6, 2.6)
    for curve in curves:
        steps = np.hypot(np.diff(curve["reference_x_m"]), np.diff(curve["reference_y_m"]))
        along = np.concatenate([[0.0], np.cumsum(steps)])
        ax.plot(along, curve.position_m, ".-", color=curve.colour, linewidth=0.8, markersize=3,
                label=curve.label)  # fmt: skip
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel("way [m]")
    ax.set_ylabel("node error [m]")
    legend(ax, 6)
    return svg(drawing, title)

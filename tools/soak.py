#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Soak test: the vehicle process for an hour on a virtual CAN bus, and what it holds meanwhile.

Makes a closed drive of the recorded one (tools/mirrored_drive.py), plays it lap after lap, and
checks: memory, threads and open files do not grow, the estimator's thread has no page fault, every
tick and everything that came in is accounted for, and the vehicle is tracked all the time. What was
found over time is drawn in WORK/soak.png. Exit code: 0 all checks passed, 1 not, 3 all but those
that the machine had no time for (a process of highest priority misses its periods, too), or there
is no virtual CAN.

The slope of the memory is judged from 20 minutes on: what is taken once takes that long to tell
from what goes on growing.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import lcm
import numpy as np
import numpy.typing as npt
from matplotlib import pyplot as plt
from scipy.stats import theilslopes

from accuracy_table import run
from freshness import outdated
from hil import (
    ROOT,
    Checks,
    Published,
    add_max_missed,
    bench_parser,
    check_ends,
    check_inputs,
    check_ticks,
    play,
    prepare_map,
    print_timing,
    write_config,
)
from lcm_types import message_types
from node_pose_table import Truth

EXAMPLES = """examples:
  make soak
  .venv/bin/python tools/soak.py --minutes 1 --json soak.json"""
SETTLED_S = 60.0
JUDGED_FROM_S = 20 * 60.0
MAX_SLOPE_MB_PER_H = 1.0
ONCE_MB = 1.0  # what is taken once and kept; the slope does not see it
LCM_QUEUE = 30  # images that wait in LCM for a receiver without time
LCM_GROWTH = 1.5  # its ring buffer grows by this factor until they find room, and stays so
MIN_TRACKING_SHARE = 0.9
MAX_ERROR_M = 0.3  # 99 % of the time
JOURNAL_MB = 16  # little: its ring of files goes round all the time
TRACKING = 1

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Held:
    """What the process held, once a second."""

    time_s: Floats
    rss_anon_mb: Floats
    threads: Floats
    files: Floats

    @staticmethod
    def read(path: Path) -> Held:
        table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
        time_s, rss_kb, threads, files = table.T
        return Held(time_s, rss_kb * 1.024e-3, threads, files)

    def settled(self) -> Held:
        """After the first minute, or the first half of less than two."""
        from_s = min(SETTLED_S, 0.5 * self.time_s[-1])
        return Held(*(values[self.time_s >= from_s] for values in astuple(self)))

    def slope_mb_per_h(self) -> float:
        """Median of the slopes between any two samples: steps that are taken back do not count."""
        every = max(1, len(self.time_s) // 1000)
        fit = theilslopes(self.rss_anon_mb[::every], self.time_s[::every] / 3600.0)
        return float(fit.slope)


def prepare(args: argparse.Namespace) -> tuple[Path, Path, Path]:
    """The closed drive, the map, and the configuration of the localiser."""
    drive, built = prepare_map(args)
    mirrored = args.work / f"{drive.name}_mirrored"
    tool = ROOT / "tools/mirrored_drive.py"
    if outdated(mirrored / "vehicle.yaml", [drive / "vehicle.yaml", drive / "can.log", tool]):
        run(sys.executable, tool, "--drive", drive, "--out", mirrored, "--force")
    vehicle = write_config(mirrored, live={"journal": {"max_mb": JOURNAL_MB}})
    return mirrored, built, vehicle


def largest_image_mb(drive: Path) -> float:
    return max(len(event.data) for event in lcm.EventLog(str(drive / "camera.lcm"))) * 1e-6


def check_held(checks: Checks, held: Held, seconds: float, image_mb: float, had_time: bool) -> None:
    slope = held.slope_mb_per_h()
    found = (
        f"{slope:+.3f} MB/h; {held.rss_anon_mb[0]:.1f} MB at first, {held.rss_anon_mb[-1]:.1f} MB "
        f"at last, {held.rss_anon_mb.min():.1f} to {held.rss_anon_mb.max():.1f} MB"
    )
    if seconds >= JUDGED_FROM_S:
        checks.add("RssAnon's slope", slope < MAX_SLOPE_MB_PER_H, found)
    else:
        print(f"       RssAnon's slope, too short to be judged: {found}")
    tenth = max(1, len(held.time_s) // 10)
    growth = float(np.median(held.rss_anon_mb[-tenth:]) - np.median(held.rss_anon_mb[:tenth]))
    limit = ONCE_MB + LCM_GROWTH * LCM_QUEUE * image_mb + MAX_SLOPE_MB_PER_H * seconds / 3600.0
    checks.add("RssAnon's growth", growth <= limit, f"{growth:+.2f} of {limit:.2f} MB", had_time)
    for name, values in (("threads", held.threads), ("open files", held.files)):
        checks.add(name, values.min() == values.max(), f"{values.min():.0f} to {values.max():.0f}")


def check_journal_size(checks: Checks, folder: Path) -> None:
    files = sorted(folder.glob("journal_*.lcm"))
    held_mb = sum(file.stat().st_size for file in files) / 2**20
    newest = int(files[-1].stem.removeprefix("journal_"))
    checks.add(
        "journal within its limit",
        round(held_mb, 1) <= JOURNAL_MB,  # a file ends with the tick that fills it
        f"{held_mb:.1f} of {JOURNAL_MB} MB, {len(files)} of {newest} files kept",
    )


class Errors:
    """Estimates against the reference of the lap, by time since the replay began."""

    def __init__(self, published: Published, truth: Truth, replay: dict[str, Any]) -> None:
        start = replay["start"]
        since_ns = np.array([e.utime * 1000 - start["unix_ns"] for e in published.estimates])
        drive_ns = start["recorded_ns"] + since_ns % replay["lap_ns"]
        modes = np.array([e.mode for e in published.estimates])
        self.tracking_share = float(np.mean(modes[since_ns >= 0] == TRACKING))
        has_pose = (since_ns >= 0) & (modes != 0) & (drive_ns <= truth.time_ns[-1])
        true_p, _ = truth.at(drive_ns[has_pose])
        found = np.array([e.position for e in published.estimates])[has_pose]
        self.time_s: Floats = 1e-9 * since_ns[has_pose]
        self.error_m: Floats = np.linalg.norm(found - true_p, axis=1)


def check_estimates(checks: Checks, errors: Errors, judged: bool) -> None:
    checks.add(
        "tracking",
        errors.tracking_share >= MIN_TRACKING_SHARE,
        f"{100 * errors.tracking_share:.2f} % of the time",
        judged,
    )
    if not errors.error_m.size:
        checks.add("position", False, "no pose", judged)
        return
    usual, most, nearly_all = np.quantile(errors.error_m, [0.5, 0.99, 0.999])
    worst = int(np.argmax(errors.error_m))
    checks.add(
        "position",
        most <= MAX_ERROR_M,
        f"{usual:.3f} m off (median), {most:.3f} m (99 %), {nearly_all:.3f} m (99.9 %), at worst "
        f"{errors.error_m[worst]:.3f} m ({errors.time_s[worst]:.0f} s)",
        judged,
    )


def draw(path: Path, held: Held, published: Published, errors: Errors) -> None:
    figure, (memory, latency, error) = plt.subplots(3, 1, figsize=(10, 9), sharex=True)
    settled = held.settled()
    memory.plot(settled.time_s / 60, settled.rss_anon_mb)
    memory.set_ylabel("RssAnon [MB]")
    begin_us = published.timings[0].utime
    minutes = [(t.utime - begin_us) / 60e6 for t in published.timings]
    ticks = [next(s for s in t.stages if s.stage == "tick") for t in published.timings]
    for name in ("p50", "p99", "p999", "max"):
        latency.semilogy(minutes, [getattr(s, f"{name}_us") for s in ticks], label=name)
    latency.set_ylabel("tick since the start [us]")
    latency.legend(loc="lower right")
    error.plot(errors.time_s / 60, errors.error_m, linewidth=0.5)
    error.set_ylabel("position error [m]")
    error.set_xlabel("time [min]")
    for axes in (memory, latency, error):
        axes.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(path, dpi=120)


def main() -> int:
    parser = bench_parser(__doc__, EXAMPLES)
    add_max_missed(parser)
    parser.add_argument("--minutes", type=float, default=60.0, help="default: %(default)s")
    args = parser.parse_args()
    drive, built, vehicle = prepare(args)
    out = args.work / "soak"
    seconds = 60.0 * args.minutes
    attempt = play(args, drive, built, vehicle, out, ["--loop"], soak_s=seconds)
    types = message_types(args.work / "lcmtypes")
    published = Published([out / "log.lcm", out / "estimates.lcm"], types)

    checks = Checks()
    if not check_ends(checks, attempt, published):
        return checks.finish(args.json)
    replay = attempt.replay
    held = Held.read(out / "memory.csv")
    errors = Errors(published, Truth(drive / "ground_truth.tum"), replay)
    # A short run may be one stall after the other.
    judged = attempt.had_time or seconds >= JUDGED_FROM_S
    check_held(checks, held.settled(), seconds, largest_image_mb(drive), judged)
    check_ticks(checks, published, args.max_missed, judged, all_recorded=False)
    check_inputs(checks, published, replay, judged)
    check_journal_size(checks, out / "journal")
    check_estimates(checks, errors, judged)
    print_timing(published.timings)
    draw(args.work / "soak.png", held, published, errors)
    print(f"\n{1e-9 * replay['lap_ns']:.1f} s a lap; over time: {args.work / 'soak.png'}")
    return checks.finish(args.json)


if __name__ == "__main__":
    sys.exit(main())

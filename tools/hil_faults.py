#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Every kind of fault, through the real process: it must survive, say so, and recover.

Plays the drive of the HIL bench with fault scripts (docs/replay.md), several faults a run, and
checks for each: something was said of it (a reason in the estimates, or a counter of the status),
the mode is back to tracking within 2 s of its end, the position is right from then on, and no
estimate had a NaN or a stamp of zero. Exit code: 0 all checks passed, 1 not.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from typing import Any

import numpy as np
import yaml

from hil import Checks, Published, bench_parser, is_sound, message_types, play, prepare
from node_pose_table import Truth

EXAMPLES = """examples:
  make hil-faults
  tools/hil_faults.py --only camera_freeze --only can_burst"""
RECOVERY_S = 2.0
MIN_TRACKING_SHARE = 0.95  # from then until the next fault
MAX_ERROR_M = 0.6  # from two seconds after a fault until the next
TRACKING = 1
REASONS = {
    "no_imu": 1, "imu_gap": 2, "no_speed": 4, "no_map_fix": 8, "map_contradicts": 16,
}  # fmt: skip


@dataclass(frozen=True)
class Fault:
    """A fault, and what the process has to say of it: one of these is enough."""

    kind: str
    for_s: float
    keys: dict[str, object]
    reasons: Sequence[str] = ()
    counters: Sequence[str] = ()  # their sum grows; "signals.*": all that begin so

    def script(self, at_s: float) -> dict[str, object]:
        return {"kind": self.kind, "at_s": at_s, "for_s": self.for_s, **self.keys}


IMU = ["IMU_ACCEL", "IMU_RATE"]
SIGNALS = ["signals.*"]
FAULTS = [
    Fault("can_dropout", 1.0, {}, ["no_imu"]),
    Fault("can_dropout", 1.5, {"messages": ["WHEEL_SPEEDS"]}, ["no_speed"]),
    Fault("can_burst", 0.6, {}, ["no_imu", "imu_gap"]),
    Fault("can_bit_errors", 1.0, {"share": 0.3, "bits": 3}, (), SIGNALS),
    Fault("can_frozen", 1.0, {"messages": IMU}, ["no_imu"], SIGNALS),
    Fault("can_duplicate", 1.0, {"share": 0.5}, (), SIGNALS),
    Fault("can_reorder", 1.0, {"share": 0.3, "by": 4}, (), SIGNALS),
    Fault("wheel_slip", 1.5, {"factor": 1.4}, (), ["filter.speed_gate_rejected"]),
    Fault("camera_drop", 2.0, {}, ["no_map_fix"]),
    Fault("camera_freeze", 2.0, {}, ["no_map_fix", "map_contradicts"]),
    Fault("camera_blackout", 2.0, {}, ["no_map_fix"], ["matching.too_few_features"]),
    Fault("camera_time_step", 2.0, {"step_s": 0.3}, (), ["frames.clock_steps"]),
    Fault("camera_time_step", 2.0, {"step_s": -0.3}, (), ["frames.clock_steps"]),
    Fault("camera_delay", 2.0, {"delay_s": 0.4}, ["no_map_fix"], ["frames.late"]),
    Fault(
        "camera_elsewhere", 2.0, {"offset_s": 10.0}, ["no_map_fix", "map_contradicts"],
        ["matching.too_few_matches"],
    ),
]  # fmt: skip
FIRST_S = 4.0
PAUSE_S = 4.5  # from a fault's end to the next


def runs(faults: Sequence[Fault], drive_s: float) -> list[list[tuple[float, Fault]]]:
    """The faults, each with its time, as few runs of the drive as they fit into."""
    result: list[list[tuple[float, Fault]]] = [[]]
    at_s = FIRST_S
    for fault in faults:
        if at_s + fault.for_s + PAUSE_S > drive_s:
            result.append([])
            at_s = FIRST_S
        result[-1].append((at_s, fault))
        at_s += fault.for_s + PAUSE_S
    return result


class Timeline:
    """Estimates and counters by time since the replay began."""

    def __init__(self, published: Published, truth: Truth, start: dict[str, int]) -> None:
        self.published = published
        valid = [e for e in published.estimates if e.mode != 0]
        self.time_s = np.array([1e-6 * (e.utime - start["unix_ns"] // 1000) for e in valid])
        self.mode = np.array([e.mode for e in valid])
        self.reasons = np.array([e.reasons for e in valid])
        recorded_ns = np.array(
            [e.utime * 1000 - start["unix_ns"] + start["recorded_ns"] for e in valid]
        )
        inside = (recorded_ns >= truth.time_ns[0]) & (recorded_ns <= truth.time_ns[-1])
        self.error_m = np.full(len(valid), np.nan)
        true_p, _ = truth.at(recorded_ns[inside])
        found = np.array([e.position for e in valid])[inside]
        self.error_m[inside] = np.linalg.norm(found - true_p, axis=1)
        self.status_s = [1e-6 * (s.utime - start["unix_ns"] // 1000) for s in published.statuses]
        self.counters = [{c.name: c.value for c in s.counters} for s in published.statuses]

    def counted(self, names: Sequence[str], from_s: float, until_s: float) -> int:
        """By how much counters grew, from the last status before to the first after."""
        before = max((i for i, s in enumerate(self.status_s) if s <= from_s), default=0)
        after = min(
            (i for i, s in enumerate(self.status_s) if s >= until_s), default=len(self.status_s) - 1
        )
        return sum(
            value - self.counters[before][name]
            for name, value in self.counters[after].items()
            if any(fnmatch(name, pattern) for pattern in names)
        )

    def between(self, from_s: float, until_s: float) -> np.ndarray[Any, np.dtype[np.bool_]]:
        return (self.time_s >= from_s) & (self.time_s < until_s)


def check(checks: Checks, timeline: Timeline, at_s: float, fault: Fault, next_s: float) -> None:
    end_s = at_s + fault.for_s
    name = f"{fault.kind} {fault.keys}" if fault.keys else fault.kind
    during = timeline.between(at_s, end_s + 0.5)
    bits = sum(REASONS[r] for r in fault.reasons)
    raised = float(np.mean(timeline.reasons[during] & bits != 0)) if bits else 0.0
    counted = timeline.counted(fault.counters, at_s, end_s) if fault.counters else 0
    checks.add(
        f"{name}: says so",
        raised > 0.0 or counted > 0,
        f"{' or '.join(fault.reasons) or 'no reason'} in {100 * raised:.0f} % of the estimates, "
        f"{counted} counted",
    )
    late = timeline.between(end_s + RECOVERY_S, next_s)
    back = timeline.time_s[(timeline.time_s >= end_s) & (timeline.mode == TRACKING)]
    worst_m = float(np.nanmax(timeline.error_m[late]))
    stays = float(np.mean(timeline.mode[late] == TRACKING))
    checks.add(
        f"{name}: recovers",
        back.size > 0
        and back[0] <= end_s + RECOVERY_S
        and stays >= MIN_TRACKING_SHARE
        and worst_m <= MAX_ERROR_M,
        f"tracking {back[0] - end_s:.1f} s after its end and {100 * stays:.0f} % of the time from "
        f"{RECOVERY_S:.0f} s on, worst error then {worst_m:.2f} m"
        if back.size
        else "never tracking again",
    )


def main() -> int:
    parser = bench_parser(__doc__, EXAMPLES)
    parser.add_argument("--only", action="append", help="only this kind of fault (may be repeated)")
    args = parser.parse_args()
    if not args.drive.is_dir():
        print(f"skipped: {args.drive} is not there")
        return 0
    drive, built, vehicle = prepare(args)
    truth = Truth(drive / "ground_truth.tum")
    drive_s = 1e-9 * float(truth.time_ns[-1] - truth.time_ns[0])
    faults = [f for f in FAULTS if not args.only or f.kind in args.only]
    types = message_types(args.work / "lcmtypes")
    checks = Checks()
    for number, run in enumerate(runs(faults, drive_s)):
        out = args.work / f"faults_{number}"
        script = args.work / f"faults_{number}.yaml"
        entries = [fault.script(at_s) for at_s, fault in run]
        script.write_text(
            yaml.safe_dump({"format": 1, "seed": 1, "faults": entries}, sort_keys=False)
        )
        until_s = run[-1][0] + run[-1][1].for_s + PAUSE_S
        play(args, drive, built, vehicle, out, ["--faults", script, "--duration", f"{until_s:g}"])
        published = Published(out / "log.lcm", types)
        ended = json.loads((out / "run.json").read_text())
        start = json.loads((out / "replay.json").read_text())["start"]
        checks.add(
            f"run {number}: survives, sound numbers and stamps",
            ended["localiser_exit"] == 0 and all(map(is_sound, published.estimates)),
            f"exit code {ended['localiser_exit']}, {len(published.estimates)} estimates",
        )
        timeline = Timeline(published, truth, start)
        ends = [at_s for at_s, _ in run[1:]] + [until_s]
        for (at_s, fault), next_s in zip(run, ends, strict=True):
            check(checks, timeline, at_s, fault, next_s)
    if args.json:
        args.json.write_text(json.dumps(checks.results, indent=2) + "\n")
    return 0 if checks.passed else 1


if __name__ == "__main__":
    sys.exit(main())

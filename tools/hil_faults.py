#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Every kind of fault, through the real process: it must survive, say so, and recover.

Plays the drive of the HIL bench with fault scripts (docs/replay.md), several faults a run, and
checks for each: something was said of it (a reason in the estimates, or a counter of the status),
the mode is back to tracking within 2 s of its end, the position is right from then on, and no
estimate had a NaN or a stamp of zero. A run that fails on a machine without time to give (a process
of highest priority misses its periods, too) is played again; that the process survives and that its
numbers are sound counts in each. At the end of a run the matcher is halted, and the localiser is
stopped in the middle of a match. Exit code: 0 all checks passed, 1 not, 3 all but those that the
machine had no time for, or there is no virtual CAN.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from typing import Any

import numpy as np
import yaml

from hil import (
    CAMERA_FRAMES,
    Attempt,
    Checks,
    Published,
    bench_parser,
    check_ends,
    check_sound,
    judge_attempts,
    play,
    prepare,
)
from lcm_types import message_types
from node_pose_table import Truth

EXAMPLES = """examples:
  make hil-faults
  .venv/bin/python tools/hil_faults.py --only camera_freeze --only can_burst"""
RECOVERY_S = 2.0
MIN_TRACKING_SHARE = 0.95  # from then until the next fault
MAX_ERROR_M = 0.6  # from two seconds after a fault until the next
RETRY_S = 240.0  # no further attempt at any run after that
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
# Then the matcher is halted, and the localiser stopped in the middle of a match.
STOP_AFTER_S = 1.5
STARTS_AFTER_S = 0.5  # the replay


Run = list[tuple[float, Fault]]  # faults, each with its time


def runs(faults: Sequence[Fault], drive_s: float) -> list[Run]:
    """As few runs of the drive as the faults fit into."""
    result: list[Run] = [[]]
    at_s = FIRST_S
    for fault in faults:
        if at_s + fault.for_s + PAUSE_S + STOP_AFTER_S > drive_s:
            result.append([])
            at_s = FIRST_S
        result[-1].append((at_s, fault))
        at_s += fault.for_s + PAUSE_S
    return result


def end_of(run: Run) -> float:
    at_s, fault = run[-1]
    return at_s + fault.for_s + PAUSE_S


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

    def described(self, from_s: float, until_s: float) -> str:
        """What was said in a while: reasons with their share of the time, counters that grew."""
        reasons = self.reasons[self.between(from_s, until_s)]
        if not reasons.size:
            return f"from {from_s:.1f} to {until_s:.1f} s: nothing was said"
        shares = {name: np.mean(reasons & bit != 0) for name, bit in REASONS.items()}
        said = ", ".join(f"{name} {100 * share:.0f} %" for name, share in shares.items() if share)
        grown = {n: self.counted([n], from_s, until_s) for n in self.counters[-1]}
        counts = ", ".join(f"{name} {value}" for name, value in grown.items() if value)
        return f"from {from_s:.1f} to {until_s:.1f} s: {said or 'no reason'}; {counts}"

    def between(self, from_s: float, until_s: float) -> np.ndarray[Any, np.dtype[np.bool_]]:
        return (self.time_s >= from_s) & (self.time_s < until_s)


def check_fault(
    checks: Checks, timeline: Timeline, at_s: float, fault: Fault, next_s: float, had_time: bool
) -> None:
    end_s = at_s + fault.for_s
    name = f"{fault.kind} {fault.keys}" if fault.keys else fault.kind
    during = timeline.between(at_s, end_s + 0.5)
    bits = sum(REASONS[r] for r in fault.reasons)
    said = timeline.reasons[during] & bits != 0
    raised = float(np.mean(said)) if said.size else 0.0
    counted = timeline.counted(fault.counters, at_s, end_s) if fault.counters else 0
    checks.add(
        f"{name}: says so",
        raised > 0.0 or counted > 0,
        f"{' or '.join(fault.reasons) or 'no reason'} in {100 * raised:.0f} % of the estimates, "
        f"{counted} counted",
        judged=had_time,
    )
    late = timeline.between(end_s + RECOVERY_S, next_s)
    back = timeline.time_s[(timeline.time_s >= end_s) & (timeline.mode == TRACKING)]
    errors_m = timeline.error_m[late & np.isfinite(timeline.error_m)]
    worst_m = float(errors_m.max()) if errors_m.size else float("inf")
    stays = float(np.mean(timeline.mode[late] == TRACKING)) if late.any() else 0.0
    recovered = (
        back.size > 0
        and back[0] <= end_s + RECOVERY_S
        and stays >= MIN_TRACKING_SHARE
        and worst_m <= MAX_ERROR_M
    )
    checks.add(
        f"{name}: recovers",
        recovered,
        f"tracking {back[0] - end_s:.1f} s after its end and {100 * stays:.0f} % of the time from "
        f"{RECOVERY_S:.0f} s on, worst error then {worst_m:.2f} m"
        if back.size
        else "never tracking again",
        judged=had_time,
    )
    if not recovered:
        print(timeline.described(end_s + RECOVERY_S, next_s), file=sys.stderr)


class FaultBench:
    """Plays runs of the drive with faults, and judges them."""

    def __init__(self, args: argparse.Namespace) -> None:
        self.args = args
        self.drive, self.built, self.vehicle = prepare(args)
        self.truth = Truth(self.drive / "ground_truth.tum")
        self.types = message_types(args.work / "lcmtypes")

    @property
    def drive_s(self) -> float:
        return 1e-9 * float(self.truth.time_ns[-1] - self.truth.time_ns[0])

    def checked(self, number: int, run: Run, limit_s: float) -> Checks:
        return judge_attempts(
            f"run {number}",
            lambda: self.played(number, run),
            lambda attempt: self.judged(attempt, run),
            limit_s,
        ).prefixed(f"run {number}: ")

    def played(self, number: int, run: Run) -> Attempt:
        script = self.args.work / f"faults_{number}.yaml"
        entries = [fault.script(at_s) for at_s, fault in run]
        script.write_text(
            yaml.safe_dump({"format": 1, "seed": 1, "faults": entries}, sort_keys=False)
        )
        return play(
            self.args, self.drive, self.built, self.vehicle, self.args.work / f"faults_{number}",
            ["--faults", script, "--duration", f"{end_of(run) + STOP_AFTER_S:g}"],
            freeze_matcher_after_s=end_of(run) + STARTS_AFTER_S,
        )  # fmt: skip

    def judged(self, attempt: Attempt, run: Run) -> Checks:
        published = Published([attempt.out / "log.lcm"], self.types)
        checks = Checks()
        if not check_ends(checks, attempt, published):
            return checks
        check_sound(checks, published)
        under_way, account = CAMERA_FRAMES.balance(published.counters)
        checks.add("stopped in the middle of a match", under_way == 1, account, attempt.had_time)
        timeline = Timeline(published, self.truth, attempt.replay["start"])
        ends = [at_s for at_s, _ in run[1:]] + [end_of(run)]
        for (at_s, fault), next_s in zip(run, ends, strict=True):
            check_fault(checks, timeline, at_s, fault, next_s, attempt.had_time)
        return checks


def main() -> int:
    parser = bench_parser(__doc__, EXAMPLES)
    parser.add_argument("--only", action="append", help="only this kind of fault (may be repeated)")
    args = parser.parse_args()
    bench = FaultBench(args)
    faults = [f for f in FAULTS if not args.only or f.kind in args.only]
    checks = Checks()
    until_s = time.monotonic() + RETRY_S
    for number, run in enumerate(runs(faults, bench.drive_s)):
        checks.results |= bench.checked(number, run, until_s - time.monotonic()).results
    return checks.finish(args.json)


if __name__ == "__main__":
    sys.exit(main())

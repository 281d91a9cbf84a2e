#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Execution time and wake-up latency of the estimator thread, beside cyclictest.

Runs the estimator's tick at 200 Hz with CAN frames and match sets coming in (1024 matches of 0.1 s
before, ten times a second), and at the same time, on another CPU, cyclictest (Debian package
rt-tests) with the same priority and period: what of the wake-up latency is the machine's, and what
ours. Figures are of the machine and what else runs on it.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = """examples:
  make tick-latency
  .venv/bin/python tools/tick_latency.py --minutes 1 --json tick.json"""
PERIOD_US = 5000
HISTOGRAM_US = 20_000  # cyclictest counts up to there


def cyclictest_summary(report: dict[str, Any]) -> dict[str, float]:
    """Percentiles of a histogram of whole microseconds, as the estimator's are reported."""
    thread = report["thread"]["0"]
    histogram = sorted((int(us), count) for us, count in thread["histogram"].items())
    total = sum(count for _, count in histogram)

    def percentile(share: float) -> float:
        seen = 0
        for us, count in histogram:
            seen += count
            if seen >= share * total:
                return us
        return float(thread["max"])

    return {
        "count": thread["cycles"],
        "p50_us": percentile(0.5),
        "p99_us": percentile(0.99),
        "p999_us": percentile(0.999),
        "max_us": thread["max"],
    }


def measure(args: argparse.Namespace) -> dict[str, Any]:
    seconds = 60.0 * args.minutes
    bench_cpu, other_cpu = args.cpus
    beside = None
    report = args.work / "cyclictest.json"
    if shutil.which("cyclictest"):
        beside = subprocess.Popen(
            [
                *("cyclictest", "--quiet", "--mlockall", f"--priority={args.priority}"),
                *(f"--interval={PERIOD_US}", f"--affinity={other_cpu}", f"--json={report}"),
                *(f"--duration={int(seconds)}", f"--histogram={HISTOGRAM_US}"),
            ],
            stdout=subprocess.DEVNULL,
        )  # fmt: skip
    else:
        print("skipped: cyclictest is not there (Debian package rt-tests)", file=sys.stderr)
    try:
        done = subprocess.run(
            [
                *(args.bins / "topoloc-tick-latency", "--seconds", f"{seconds:g}"),
                *("--cpu", str(bench_cpu), "--priority", str(args.priority)),
            ],
            check=True,
            stdout=subprocess.PIPE,
        )
    except BaseException:
        if beside is not None:
            beside.terminate()
        raise
    result: dict[str, Any] = json.loads(done.stdout)
    if beside is not None:
        if beside.wait() == 0:
            result["cyclictest"] = cyclictest_summary(json.loads(report.read_text()))
        else:
            print("skipped: cyclictest failed (no privilege?)", file=sys.stderr)
    return result


def print_table(result: dict[str, Any]) -> None:
    ticks, sets = result["ticks"], result["match_sets"]
    print(
        f"{ticks['done']} ticks, {ticks['missed']} missed; {sets['accepted']} of "
        f"{sets['handed_over']} match sets used; {result['page_faults']} page faults"
    )
    print("\n| | count | p50 [us] | p99 [us] | p99.9 [us] | max [us] |")
    print("|---|---|---|---|---|---|")
    names = {
        "tick_without_update": "tick without update",
        "tick_with_update": "tick with update",
        "wake_up": "wake-up of the estimator",
        "cyclictest": "cyclictest",
    }
    for key, name in names.items():
        if key in result:
            s = result[key]
            print(f"| {name} | {s['count']} | {s['p50_us']:.0f} | {s['p99_us']:.0f} | "
                  f"{s['p999_us']:.0f} | {s['max_us']:.0f} |")  # fmt: skip
    for warning in result["warnings"]:
        print(f"warning: {warning}")


def main() -> int:
    cpus = sorted(os.sched_getaffinity(0))
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="default: %(default)s")
    parser.add_argument("--priority", type=int, default=80, help="SCHED_FIFO (default: 80)")
    parser.add_argument(
        "--cpus",
        type=int,
        nargs=2,
        metavar=("ESTIMATOR", "CYCLICTEST"),
        default=(cpus[-1], cpus[0]),
        help="where they run (default: last and first)",
    )
    parser.add_argument("--bins", type=Path, default=ROOT / "build/release/bin")
    parser.add_argument("--work", type=Path, default=ROOT / "build/tick-latency")
    parser.add_argument("--json", type=Path, help="the result as JSON")
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    result = measure(args)
    print_table(result)
    if args.json:
        args.json.write_text(json.dumps(result, indent=2) + "\n")
    used = result["match_sets"]["accepted"] > 0.9 * result["match_sets"]["handed_over"]
    if not used:
        print("tick_latency: match sets were not used, the figures mean nothing", file=sys.stderr)
    return 0 if used else 1


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Hardware-in-the-loop bench: the vehicle process on a virtual CAN bus, fed in real time.

Imports the drive and maps its even frames (where that is not done yet), starts the localiser,
plays the drive's CAN frames and odd camera frames to it, records what it says on LCM, and checks:
every tick is accounted for, nothing is lost on the way, the poses are right, and replaying the
journal gives what was published, byte for byte. Exit code: 0 all checks passed, 1 not.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from itertools import chain
from pathlib import Path
from typing import Any

import lcm
import yaml

from accuracy_table import evaluate, run
from demo import import_drive
from freshness import outdated
from lcm_types import message_types

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = """examples:
  make hil
  .venv/bin/python tools/hil.py --drive ../shared/data/kitti_0039 --seconds 15 --json hil.json"""
RATE_HZ = 200.0  # of the estimator
MAX_APET_M = 0.12
NO_VCAN = 125  # exit code of tools/with-vcan
MAX_MISSED_SHARE = 0.005
NOT_JUDGED = 3  # exit code
# Share of the periods in which a process of highest priority did not run, either: with more, there
# was no time, whatever the localiser did.
MAX_MACHINE_MISSED = 0.002
STOP_S = 5.0  # from the end of a soak's replay to that of the localiser


class Published:
    """What the localiser said, as it was recorded."""

    def __init__(self, logs: Sequence[Path], types: Any) -> None:
        self.estimates_raw: list[bytes] = []
        self.statuses: list[Any] = []
        self.timings: list[Any] = []
        for event in chain.from_iterable(lcm.EventLog(str(log)) for log in logs):
            if event.channel == "TOPOLOC_ESTIMATE":
                self.estimates_raw.append(event.data)
            elif event.channel == "TOPOLOC_STATUS":
                self.statuses.append(types.status_t.decode(event.data))
            elif event.channel == "TOPOLOC_TIMING":
                self.timings.append(types.timing_t.decode(event.data))
        self.estimates = [types.estimate_t.decode(data) for data in self.estimates_raw]
        last = self.statuses[-1]
        self.counters = {c.name: c.value for c in last.counters}
        self.stopped_cleanly = bool(last.stopping)

    def write_tum(self, path: Path, shift_us: int) -> None:
        """Poses, with their stamps moved back onto the drive's time."""
        lines = []
        for e in self.estimates:
            if e.mode == 0:
                continue
            stamp = e.utime + shift_us
            w, x, y, z = e.orientation
            numbers = " ".join(f"{v:.9f}" for v in (*e.position, x, y, z, w))
            lines.append(f"{stamp // 10**6}.{stamp % 10**6:06d} {numbers}\n")
        path.write_text("".join(lines))


def is_sound(estimate: Any) -> bool:
    numbers = (
        *estimate.position, *estimate.orientation, *estimate.velocity, *estimate.covariance,
        *estimate.accel_bias, *estimate.gyro_bias, *estimate.gravity,
    )  # fmt: skip
    return estimate.utime > 0 and all(math.isfinite(v) for v in numbers)


class Checks:
    """Prints each check and remembers whether all passed."""

    def __init__(self) -> None:
        self.results: dict[str, dict[str, Any]] = {}

    def add(self, name: str, passed: bool, found: object, judged: bool = True) -> None:
        """`judged`: false where a failure may be the machine's."""
        passed = bool(passed)  # numpy has its own
        self.results[name] = {"passed": passed, "judged": passed or judged, "found": found}
        verdict = "ok" if passed else "FAILED" if judged else "NOT JUDGED"
        print(f"{verdict:6} {name}: {found}", flush=True)

    @property
    def passed(self) -> bool:
        return all(r["passed"] for r in self.results.values())

    def finish(self, file: Path | None) -> int:
        """Writes all as JSON where a file is given. Exit code: 0 all passed, 1 not, 3 all but those
        that the machine had no time for."""
        if file:
            file.write_text(json.dumps(self.results, indent=2) + "\n")
        failed = [r for r in self.results.values() if not r["passed"]]
        return 0 if not failed else 1 if any(r["judged"] for r in failed) else NOT_JUDGED


def first_pose(trajectory: Path) -> str:
    lines = trajectory.read_text().splitlines()
    first = next(line for line in lines if line and not line.startswith("#"))
    return " ".join(first.split()[1:8])


def prepare_map(args: argparse.Namespace) -> tuple[Path, Path]:
    """Drive folder and map of its even frames."""
    drive = args.work / args.drive.name
    args.work.mkdir(parents=True, exist_ok=True)
    cloud = import_drive(args.drive.resolve(), drive)
    built = args.work / f"{args.drive.name}.tmap"
    if outdated(built, [drive, cloud, args.bins / "topoloc-map"]):
        run(
            args.bins / "topoloc-map", "build", "--drive", drive, "--cloud", cloud,
            "--trajectory", drive / "ground_truth.tum", "--frames", "even",
            "--every-metres", "5", "--out", built,
        )  # fmt: skip
    return drive, built


def write_config(drive: Path, **sections: Mapping[str, object]) -> Path:
    """Configuration of the localiser: the drive's own, as the bench needs it."""
    # One CPU has to do for everything in a guest: no network for matching.
    config = yaml.safe_load((drive / "vehicle.yaml").read_text())
    config["matching"] = {"matcher": "mutual", "threads": 1}
    config["can"]["checks"] = [
        {"message": message, "counter": f"{prefix}_COUNTER"}
        for message, prefix in (
            ("IMU_ACCEL", "ACCEL"),
            ("IMU_RATE", "RATE"),
            ("WHEEL_SPEEDS", "SPEED"),
            ("TRAVEL_DIRECTION", "DIRECTION"),
        )
    ]
    vehicle = drive / "vehicle_hil.yaml"
    vehicle.write_text(yaml.safe_dump(config | sections, sort_keys=False))
    return vehicle


def prepare(args: argparse.Namespace) -> tuple[Path, Path, Path]:
    """Drive folder, map of its even frames, and the configuration of the localiser."""
    drive, built = prepare_map(args)
    return drive, built, write_config(drive)


def play(
    args: argparse.Namespace,
    drive: Path,
    built: Path,
    vehicle: Path,
    out: Path,
    options: Sequence[str | Path],
    soak_s: float | None = None,
) -> None:
    """Runs the processes; what they say is in `out` (tools/hil_guest.py). Odd frames only."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    timeout_s = 600 + round(soak_s or 0)
    soak = () if soak_s is None else ("--seconds", f"{soak_s:g}")
    done = subprocess.run(
        [
            *(ROOT / "tools/with-vcan", "--timeout", str(timeout_s), "--"),
            *(sys.executable, ROOT / "tools/hil_guest.py", "--bins", args.bins, "--work", out),
            *("--localiser", args.localiser, "--config", vehicle, "--map", built, "--drive", drive),
            f"--initial-pose={first_pose(drive / 'ground_truth.tum')}",
            *(*soak, "--replay", "--frames", "odd", *options),
        ],
        check=False,
    )
    if done.returncode == NO_VCAN:
        print("skipped: there is no virtual CAN to be had here")
        sys.exit(0)
    if done.returncode != 0:
        sys.exit(f"hil: the run failed (exit code {done.returncode}), see {out}")


@dataclass(frozen=True)
class Book:
    """What came in, and what became of it: sums of counters, `*` for all whose names match."""

    name: str
    came: str
    went: Sequence[str]
    under_way: int = 0  # at most so many are still on their way when the process stops


FRAME_STAMPS = ["frames.accepted", "frames.time_not_monotonic", "frames.time_in_future",
                "frames.too_old", "frames.clock_step"]  # fmt: skip
FRAME_FATES = ["frames.matched", "frames.undecodable", "frames.not_started",
               "frames.no_prediction", "frames.not_matched", "frames.estimator_busy",
               "frames.failed", "frames.overwritten", "frames.discarded"]  # fmt: skip
SIGNALS = ["used", "waiting", "other_frames", "not_a_data_frame", "too_short",
           "multiplex_mismatch", "out_of_limits", "not_finite", "non-monotonic_time",
           "leap_in_time", "unpaired", "wrong_checksum", "counter_out_of_range",
           "counter_frozen"]  # fmt: skip
BOOKS = [
    Book("CAN frames", "can.frames",
         ["can.before_start", "can.over_tick", *(f"signals.{name}" for name in SIGNALS)]),
    Book("IMU samples", "signals.imu_samples", ["imu.*"]),
    Book("wheel speeds", "signals.speed_samples", ["speed.*", "filter.speed_unused"]),
    Book("camera messages", "images.ok", ["images.wrong_size", *FRAME_STAMPS]),
    Book("camera frames", "frames.accepted", FRAME_FATES, under_way=1),
    Book("match sets", "frames.matched", ["match_sets.*"], under_way=4),
    Book("map updates", "match_sets.inserted", ["map.*"], under_way=4),
]  # fmt: skip


def check_books(checks: Checks, counters: dict[str, int]) -> None:
    """Whatever came in is in exactly one of the counters of what became of it."""
    for book in BOOKS:
        came = counters[book.came]
        went = {
            name: count
            for pattern in book.went
            for name, count in counters.items()
            if fnmatch(name, pattern)
        }
        parts = " + ".join(f"{count} {name}" for name, count in went.items() if count)
        checks.add(
            f"books of the {book.name}",
            0 <= came - sum(went.values()) <= book.under_way,
            f"{came} = {parts}",
        )


def check_ticks(
    checks: Checks, published: Published, max_missed: float, all_recorded: bool = True
) -> None:
    """`all_recorded`: every estimate is there, up to the last."""
    c = published.counters
    ticks = [e.tick for e in published.estimates]
    first, last = published.estimates[0], published.estimates[-1]
    by_clock = ticks[0] + round(1e-6 * (last.utime - first.utime) * RATE_HZ) + 1
    begun = c["ticks.done"] + c["ticks.missed"]
    after_the_last = begun - ticks[-1] - 1
    checks.add(
        "published + missed = elapsed x rate",
        (after_the_last == 0 if all_recorded else 0 <= after_the_last < STOP_S * RATE_HZ)
        and abs(ticks[-1] + 1 - by_clock) <= 2  # states are of now, or of newer data
        and c["estimates.published"] + c["estimates.lost"] == c["ticks.done"],
        f"{c['estimates.published']} published, {c['estimates.lost']} lost, "
        f"{c['ticks.missed']} missed of {begun}, {by_clock + after_the_last} by the clock",
    )
    share = c["ticks.missed"] / begun
    checks.add("missed ticks", share <= max_missed, f"{100 * share:.2f} %")
    if all_recorded:
        checks.add(
            "received = published",
            len(ticks) == c["estimates.published"],
            f"{len(ticks)} of {c['estimates.published']}",
        )
    faults = c["page_faults.minor"] + c["page_faults.major"]
    checks.add("page faults of the estimator thread", faults == 0, faults)
    checks.add(
        "sound numbers and stamps", all(is_sound(e) for e in published.estimates), len(ticks)
    )


def check_inputs(checks: Checks, published: Published, replay: dict[str, Any]) -> None:
    c = published.counters
    sent = replay["can"]["sent"]
    checks.add(
        "CAN frames received = sent, none lost",
        c["can.frames"] == sent and c["can.dropped"] == 0 and c["signals.lost_messages"] == 0,
        f"{c['can.frames']} of {sent}, {c['can.dropped']} dropped, "
        f"{c['signals.lost_messages']} missing by the messages' counters",
    )
    images = replay["camera"]["sent"]
    checks.add(
        "camera frames received = sent", c["images.ok"] == images, f"{c['images.ok']} of {images}"
    )
    check_books(checks, c)


def check_ends(checks: Checks, published: Published, ended: dict[str, Any]) -> None:
    checks.add(
        "processes ended well",
        ended["localiser_exit"] == 0 and ended["replay_exit"] == 0 and published.stopped_cleanly,
        f"exit codes {ended['localiser_exit']} and {ended['replay_exit']}, "
        f"stopped in {ended['stop_ms']:.0f} ms",
    )


def check_journal(checks: Checks, args: argparse.Namespace, vehicle: Path, out: Path,
                  published: Published) -> None:  # fmt: skip
    replayed = out / "replayed.tum"
    run(args.bins / "topoloc-localise", "--config", vehicle, "--replay", out / "journal",
        "--out", replayed)  # fmt: skip
    again = [event.data for event in lcm.EventLog(str(replayed.with_suffix(".lcm")))]
    same = len(set(again) & set(published.estimates_raw))  # each has its number in it
    checks.add(
        "journal replayed, byte for byte",
        same == len(published.estimates_raw)
        and len(again) == published.counters["estimates.published"],
        f"{same} of {len(published.estimates_raw)} alike",
    )


def check_accuracy(checks: Checks, args: argparse.Namespace, drive: Path, out: Path,
                   published: Published, replay: dict[str, Any]) -> None:  # fmt: skip
    estimate = out / "published.tum"
    start = replay["start"]
    published.write_tum(estimate, (start["recorded_ns"] - start["unix_ns"]) // 1000)
    errors = evaluate(args.bins, drive / "ground_truth.tum", estimate)
    checks.add("APEt", errors["apet_m"] <= MAX_APET_M, f"{errors['apet_m']:.3f} m")


def print_timing(timing: Any) -> None:
    print("\n| stage | count | p50 [us] | p99 [us] | p99.9 [us] | max [us] |")
    print("|---|---|---|---|---|---|")
    for s in timing.stages:
        print(f"| {s.stage} | {s.count} | {s.p50_us:.0f} | {s.p99_us:.0f} | {s.p999_us:.0f} | "
              f"{s.max_us:.0f} |")  # fmt: skip


def bench_parser(description: str | None, epilog: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=description,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--drive", type=Path, help="source of KITTI drive 0039; default: shared")
    parser.add_argument("--bins", type=Path, default=ROOT / "build/release/bin")
    parser.add_argument(
        "--localiser",
        type=Path,
        default=ROOT / "build/traps/bin/topoloc-localise",
        help="the process on trial; default: the build with real-time traps",
    )
    parser.add_argument("--work", type=Path, default=ROOT / "build/hil")
    parser.add_argument("--json", type=Path, help="checks and what they found, as JSON")
    return parser


def has_drive(args: argparse.Namespace) -> bool:
    """False where there is no shared drive and none was given."""
    given = args.drive is not None
    shared = Path(os.environ.get("TOPOLOC_DATA", ROOT / "../shared/data"))
    args.drive = args.drive if given else shared / "kitti_0039"
    if args.drive.is_dir():
        return True
    if given:
        sys.exit(f"{args.drive}: no such folder")
    print(f"skipped: {args.drive} is not there (give --drive or set TOPOLOC_DATA)")
    return False


def add_max_missed(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--max-missed",
        type=float,
        default=MAX_MISSED_SHARE,
        help="share of ticks that may be missed (default: %(default)s)",
    )


def main() -> int:
    parser = bench_parser(__doc__, EXAMPLES)
    add_max_missed(parser)
    parser.add_argument("--seconds", type=float, default=1e5, help="only so much of the drive")
    args = parser.parse_args()
    if not has_drive(args):
        return 0
    drive, built, vehicle = prepare(args)
    out = args.work / "run"
    play(args, drive, built, vehicle, out, ["--duration", f"{args.seconds:g}"])
    ended = json.loads((out / "run.json").read_text())
    replay = json.loads((out / "replay.json").read_text())
    published = Published([out / "log.lcm"], message_types(args.work / "lcmtypes"))

    checks = Checks()
    check_ends(checks, published, ended)
    check_ticks(checks, published, args.max_missed)
    check_inputs(checks, published, replay)
    check_accuracy(checks, args, drive, out, published, replay)
    check_journal(checks, args, vehicle, out, published)
    print_timing(published.timings[-1])
    return checks.finish(args.json)


if __name__ == "__main__":
    sys.exit(main())

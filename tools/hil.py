#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Hardware-in-the-loop bench: the vehicle process on a virtual CAN bus, fed in real time.

Imports or simulates the drive and maps its even frames (where that is not done yet), starts the
localiser, plays the drive's CAN frames and odd camera frames to it, records what it says on LCM,
and checks: every tick is accounted for, nothing is lost on the way, the poses are right, and
replaying the journal gives what was published, byte for byte. A run that fails on a machine without
time to give (a process of highest priority misses its periods, too) is played again; what is the
process's own duty on any machine counts in each. A stop is too slow if it takes more than 200 ms
beyond what that process was held up meanwhile (but for 20 ms, which the end of the localiser itself
may hold it up); one that takes more only with that is not judged, and the run is played again. Exit
code: 0 all checks passed, 1 not, 3 all but those that the machine had no time for, or there is no
virtual CAN.
"""

from __future__ import annotations

import argparse
import json
import math
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from itertools import chain
from pathlib import Path
from typing import Any

import lcm
import numpy as np
import yaml

from accuracy_table import evaluate, run
from bench_drive import bench_drive
from freshness import outdated
from hil_guest import MAX_MACHINE_MISSED
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
MAX_STOP_MS = 200.0
# What holds up a process of highest priority in a stop on a machine with time, at most: the kernel,
# in one piece, while it takes back the localiser's memory. That is the localiser's own.
END_HOLDS_UP_MS = 20.0
TRIES = 3
RETRY_S = 120.0  # no further attempt after that
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
        self.counters: dict[str, int] = {}
        self.has_last_status = False  # the one of the end: then the counters are final
        if self.statuses:
            self.counters = {c.name: c.value for c in self.statuses[-1].counters}
            self.has_last_status = bool(self.statuses[-1].stopping)

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

    @property
    def failed(self) -> bool:
        """Something that can be held against the process, whatever the machine."""
        return any(r["judged"] and not r["passed"] for r in self.results.values())

    def add_attempt(self, attempt: Checks) -> None:
        """What was found in another attempt at the same. What cannot be judged does not undo what
        was found to be right."""
        for name, result in attempt.results.items():
            if result["judged"] or not self.results.get(name, {"passed": False})["passed"]:
                self.results[name] = result

    def prefixed(self, prefix: str) -> Checks:
        named = Checks()
        named.results = {prefix + name: result for name, result in self.results.items()}
        return named

    def finish(self, file: Path | None) -> int:
        """Writes all as JSON where a file is given. Exit code: 0 all passed, 1 not, 3 all but those
        that the machine had no time for."""
        if file:
            file.write_text(json.dumps(self.results, indent=2) + "\n")
        if self.passed:
            return 0
        verdict = "FAILED" if self.failed else "NOT JUDGED"
        names = [
            n for n, r in self.results.items() if not r["passed"] and r["judged"] == self.failed
        ]
        print(f"{verdict}: {', '.join(names)}", flush=True)
        return 1 if self.failed else NOT_JUDGED


@dataclass(frozen=True)
class Attempt:
    """A run of the processes."""

    out: Path
    ended: dict[str, Any]  # run.json

    @property
    def machine_missed(self) -> float:
        """Share of the periods in which a process of highest priority did not run, either."""
        return float(self.ended["machine_missed_share"])

    @property
    def had_time(self) -> bool:
        return self.machine_missed <= MAX_MACHINE_MISSED

    @property
    def stop_judged(self) -> bool:
        """Whether a stop that took too long took so long by itself."""
        taken_ms = max(0.0, float(self.ended["stop_held_up_ms"]) - END_HOLDS_UP_MS)
        return self.had_time and float(self.ended["stop_ms"]) - taken_ms > MAX_STOP_MS

    @property
    def replay(self) -> dict[str, Any]:
        summary: dict[str, Any] = json.loads((self.out / "replay.json").read_text())
        return summary


def judge_attempts(
    what: str, play_once: Callable[[], Attempt], judge: Callable[[Attempt], Checks], limit_s: float
) -> Checks:
    """Plays up to three times, until a run passed or shows something to be held against the
    process. None begins later than `limit_s` after the first."""
    found = Checks()
    begin_s = time.monotonic()
    for number in range(1, TRIES + 1):
        attempt = play_once()
        checks = judge(attempt)
        found.add_attempt(checks)
        if checks.passed or found.passed or checks.failed:
            break
        print(
            f"{what}, attempt {number} of {TRIES}: the machine gave no time in "
            f"{100 * attempt.machine_missed:.1f} % of the periods, held up for "
            f"{attempt.ended['stop_held_up_ms']:.0f} ms in the stop",
            flush=True,
        )
        if time.monotonic() - begin_s > limit_s:
            break
    return found


def first_pose(trajectory: Path) -> str:
    lines = trajectory.read_text().splitlines()
    first = next(line for line in lines if line and not line.startswith("#"))
    return " ".join(first.split()[1:8])


def prepare_map(args: argparse.Namespace) -> tuple[Path, Path]:
    """Drive folder and map of its even frames."""
    drive, cloud = bench_drive(args.drive, args.work, args.bins)
    built = args.work / f"{drive.name}.tmap"
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
    text = yaml.safe_dump(config | sections, sort_keys=False)
    if not vehicle.is_file() or vehicle.read_text() != text:  # what is newer makes the map outdated
        vehicle.write_text(text)
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
    freeze_matcher_after_s: float | None = None,
) -> Attempt:
    """Runs the processes; what they say is in `out` (tools/hil_guest.py). Odd frames only."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    timeout_s = 300 + round(soak_s or 0)
    times = {"--seconds": soak_s, "--freeze-matcher-after": freeze_matcher_after_s}
    given = [(name, f"{value:g}") for name, value in times.items() if value is not None]
    done = subprocess.run(
        [
            *(ROOT / "tools/with-vcan", "--timeout", str(timeout_s), "--"),
            *(sys.executable, ROOT / "tools/hil_guest.py", "--bins", args.bins, "--work", out),
            *("--localiser", args.localiser, "--config", vehicle, "--map", built, "--drive", drive),
            f"--initial-pose={first_pose(drive / 'ground_truth.tum')}",
            *(*chain(*given), "--replay", "--frames", "odd", *options),
        ],
        check=False,
    )
    if done.returncode == NO_VCAN:
        print("NOT JUDGED: there is no virtual CAN to be had here")
        sys.exit(NOT_JUDGED)
    if done.returncode != 0:
        sys.exit(f"hil: the run failed (exit code {done.returncode}), see {out}")
    return Attempt(out, json.loads((out / "run.json").read_text()))


@dataclass(frozen=True)
class Book:
    """What came in, and what became of it: sums of counters, `*` for all whose names match."""

    name: str
    came: str
    went: Sequence[str]
    under_way: int = 0  # at most so many are still on their way when the process stops

    def balance(self, counters: dict[str, int]) -> tuple[int, str]:
        """How many are still on their way, and the account."""
        came = counters[self.came]
        went = {
            name: count
            for pattern in self.went
            for name, count in counters.items()
            if fnmatch(name, pattern)
        }
        parts = " + ".join(f"{count} {name}" for name, count in went.items() if count)
        return came - sum(went.values()), f"{came} = {parts}"


FRAME_STAMPS = ["frames.accepted", "frames.time_not_monotonic", "frames.time_in_future",
                "frames.too_old", "frames.clock_step"]  # fmt: skip
FRAME_FATES = ["frames.matched", "frames.undecodable", "frames.not_started",
               "frames.no_prediction", "frames.not_matched", "frames.estimator_busy",
               "frames.failed", "frames.overwritten", "frames.discarded"]  # fmt: skip
SIGNALS = ["used", "waiting", "other_frames", "not_a_data_frame", "too_short",
           "multiplex_mismatch", "out_of_limits", "not_finite", "non-monotonic_time",
           "leap_in_time", "unpaired", "wrong_checksum", "counter_out_of_range",
           "counter_frozen"]  # fmt: skip
CAMERA_FRAMES = Book("camera frames", "frames.accepted", FRAME_FATES, under_way=1)
BOOKS = [
    Book("CAN frames", "can.frames",
         ["can.before_start", "can.over_tick", *(f"signals.{name}" for name in SIGNALS)]),
    Book("IMU samples", "signals.imu_samples", ["imu.*"]),
    Book("wheel speeds", "signals.speed_samples", ["speed.*", "filter.speed_unused"]),
    Book("camera messages", "images.ok", ["images.wrong_size", *FRAME_STAMPS]),
    CAMERA_FRAMES,
    Book("match sets", "frames.matched", ["match_sets.*"], under_way=4),
    Book("map updates", "match_sets.inserted", ["map.*"], under_way=4),
]  # fmt: skip


def check_books(checks: Checks, counters: dict[str, int], judged: bool = True) -> None:
    """Whatever came in is in exactly one of the counters of what became of it."""
    for book in BOOKS:
        under_way, account = book.balance(counters)
        checks.add(f"books of the {book.name}", 0 <= under_way <= book.under_way, account, judged)


def begun_by_clock(published: Published) -> int:
    """Periods until the last estimate, by the estimates' stamps; those of late ticks are late."""
    ticks = np.array([e.tick for e in published.estimates])
    beats = ticks - 1e-6 * RATE_HZ * np.array(
        [e.utime - published.estimates[0].utime for e in published.estimates]
    )
    second = round(RATE_HZ)
    slipped = float(beats[-second:].max() - beats[:second].max())
    return int(ticks[-1]) + 1 - round(slipped)


def check_ticks(
    checks: Checks,
    published: Published,
    max_missed: float,
    had_time: bool,
    all_recorded: bool = True,
) -> None:
    """`all_recorded`: every estimate is there, up to the last."""
    c = published.counters
    last = published.estimates[-1].tick
    begun = c["ticks.done"] + c["ticks.missed"]
    after_the_last = begun - last - 1
    by_clock = begun_by_clock(published)
    checks.add(
        "published + missed = elapsed x rate",
        0 <= after_the_last < STOP_S * RATE_HZ
        and abs(last + 1 - by_clock) <= 2  # states are of now, or of newer data
        and c["estimates.published"] + c["estimates.lost"] == c["ticks.done"],
        f"{c['estimates.published']} published, {c['estimates.lost']} lost, "
        f"{c['ticks.missed']} missed of {begun}, {by_clock + after_the_last} by the clock",
        had_time or published.has_last_status,
    )
    share = c["ticks.missed"] / begun
    checks.add("missed ticks", share <= max_missed, f"{100 * share:.2f} %", had_time)
    if all_recorded:  # by another process, which may have had no time
        checks.add(
            "received = published",
            len(published.estimates) == c["estimates.published"] and after_the_last == 0,
            f"{len(published.estimates)} of {c['estimates.published']}",
            had_time,
        )
    faults = c["page_faults.minor"] + c["page_faults.major"]
    checks.add("page faults of the estimator thread", faults == 0, faults)
    check_sound(checks, published)


def check_sound(checks: Checks, published: Published) -> None:
    estimates = published.estimates
    checks.add("sound numbers and stamps", all(map(is_sound, estimates)), len(estimates))


def check_inputs(checks: Checks, published: Published, replay: dict[str, Any],
                 had_time: bool) -> None:  # fmt: skip
    c = published.counters
    final = had_time or published.has_last_status
    sent = replay["can"]["sent"]
    checks.add(
        "CAN frames received = sent, none lost",
        c["can.frames"] == sent and c["can.dropped"] == 0 and c["signals.lost_messages"] == 0,
        f"{c['can.frames']} of {sent}, {c['can.dropped']} dropped, "
        f"{c['signals.lost_messages']} missing by the messages' counters",
        final,
    )
    images = replay["camera"]["sent"]
    checks.add(  # LCM is not reliable
        "camera frames received = sent",
        c["images.ok"] == images,
        f"{c['images.ok']} of {images}",
        had_time,
    )
    check_books(checks, c, final)


def check_ends(checks: Checks, attempt: Attempt, published: Published) -> bool:
    """Whether there is something to check further."""
    ended = attempt.ended
    checks.add(
        "localiser starts",
        ended["started"],
        f"it ended with exit code {ended['localiser_exit']}"
        if ended["died_at_the_start"]
        else "within a minute"
        if ended["started"]
        else "not within a minute",
        attempt.had_time or ended["died_at_the_start"],
    )
    if not ended["started"]:
        return False
    checks.add(
        "processes ended well",
        ended["localiser_exit"] == 0 and ended["replay_exit"] == 0,
        f"exit codes {ended['localiser_exit']} and {ended['replay_exit']}",
    )
    checks.add(
        "ends with a last status",
        published.has_last_status,
        "it came" if published.has_last_status else "none",
        attempt.had_time,
    )
    checks.add(
        "stops in time",
        ended["stop_ms"] <= MAX_STOP_MS,
        f"{ended['stop_ms']:.0f} ms, in which one of highest priority was held up for "
        f"{ended['stop_held_up_ms']:.0f} ms",
        attempt.stop_judged,
    )
    heard = bool(published.counters) and bool(published.estimates)
    if not heard:
        checks.add("something is published", heard, "nothing", attempt.had_time)
    return heard


def check_journal(checks: Checks, args: argparse.Namespace, vehicle: Path, attempt: Attempt,
                  published: Published) -> None:  # fmt: skip
    out = attempt.out
    c = published.counters
    lost = c["journal.lost_ticks"] + c["journal.lost_match_sets"]
    if lost > 0 and not attempt.had_time:
        # The recorder was 1.3 s late. The journal says so itself; there is nothing to compare.
        checks.add("journal replayed, byte for byte", False, f"{lost} lost", judged=False)
        return
    replayed = out / "replayed.tum"
    run(args.bins / "topoloc-localise", "--config", vehicle, "--replay", out / "journal",
        "--out", replayed)  # fmt: skip
    again = [event.data for event in lcm.EventLog(str(replayed.with_suffix(".lcm")))]
    same = len(set(again) & set(published.estimates_raw))  # each has its number in it
    checks.add(
        "journal replayed, byte for byte",
        same == len(published.estimates_raw)
        and (len(again) == c["estimates.published"] + c["estimates.lost"]),
        f"{same} of {len(published.estimates_raw)} alike, {len(again)} in all",
        attempt.had_time or published.has_last_status,
    )


def check_accuracy(checks: Checks, args: argparse.Namespace, drive: Path, attempt: Attempt,
                   published: Published) -> None:  # fmt: skip
    estimate = attempt.out / "published.tum"
    start = attempt.replay["start"]
    published.write_tum(estimate, (start["recorded_ns"] - start["unix_ns"]) // 1000)
    if estimate.stat().st_size == 0:
        checks.add("APEt", False, "no pose", attempt.had_time)
        return
    errors = evaluate(args.bins, drive / "ground_truth.tum", estimate)
    checks.add(
        "APEt", errors["apet_m"] <= MAX_APET_M, f"{errors['apet_m']:.3f} m", attempt.had_time
    )


def print_timing(timings: Sequence[Any]) -> None:
    if not timings:
        return
    print("\n| stage | count | p50 [us] | p99 [us] | p99.9 [us] | max [us] |")
    print("|---|---|---|---|---|---|")
    for s in timings[-1].stages:
        print(f"| {s.stage} | {s.count} | {s.p50_us:.0f} | {s.p99_us:.0f} | {s.p999_us:.0f} | "
              f"{s.max_us:.0f} |")  # fmt: skip


def bench_parser(description: str | None, epilog: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description=description,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--drive",
        type=Path,
        help="a recording, or a drive folder with its cloud; default: the shared KITTI drive 0039, "
        "or, where that is not, a simulated one",
    )
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
    drive, built, vehicle = prepare(args)

    def play_once() -> Attempt:
        duration = f"{args.seconds:g}"
        return play(args, drive, built, vehicle, args.work / "run", ["--duration", duration])

    def judge(attempt: Attempt) -> Checks:
        published = Published([attempt.out / "log.lcm"], message_types(args.work / "lcmtypes"))
        checks = Checks()
        if check_ends(checks, attempt, published):
            check_ticks(checks, published, args.max_missed, attempt.had_time)
            check_inputs(checks, published, attempt.replay, attempt.had_time)
            check_accuracy(checks, args, drive, attempt, published)
            check_journal(checks, args, vehicle, attempt, published)
            print_timing(published.timings)
        return checks

    return judge_attempts("hil", play_once, judge, RETRY_S).finish(args.json)


if __name__ == "__main__":
    sys.exit(main())

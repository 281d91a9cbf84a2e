#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The part of the HIL bench that needs CAN: localiser, replay and lcm-logger as processes.

Runs inside tools/with-vcan. Everything the processes say goes into --work: log.lcm (what was on
LCM), localiser.log, replay.json, journal/, run.json (exit codes, times).

With --seconds the replay is ended after so long, log.lcm holds the status and only some of the
estimates, and memory.csv has what the localiser holds, once a second.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import json
import multiprocessing
import os
import resource
import signal
import subprocess
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import lcm

MOST_WAIT_S = 60.0  # for the localiser to start or to end, on a machine without time
LCM_URL = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4000000"
# Share of the periods in which a process of highest priority did not run, either: with more, there
# was no time, whatever the localiser did.
MAX_MACHINE_MISSED = 0.002
STOP_WATCH_PERIOD_S = 0.002  # a stop is short
ESTIMATE_EVERY = 20  # of those that a soak keeps


def wait_for_text(log: Path, text: str, process: subprocess.Popen[bytes], timeout_s: float) -> bool:
    until = time.monotonic() + timeout_s
    while text not in log.read_text():
        if process.poll() is not None or time.monotonic() > until:
            print(f"hil: the localiser did not start:\n{log.read_text()}", flush=True)
            return False
        time.sleep(0.05)
    return True


def start_localiser(args: argparse.Namespace) -> tuple[subprocess.Popen[bytes], bool]:
    """The process, and whether it is ready."""
    log = args.work / "localiser.log"
    with log.open("wb") as out:
        localiser = subprocess.Popen(
            [
                *(args.localiser, "--config", args.config, "--map", args.map),
                *("--can", "can0=vcan0", "--lcm", LCM_URL, "--journal", args.work / "journal"),
                f"--initial-pose={args.initial_pose}",
            ],
            stdout=out,
            stderr=subprocess.STDOUT,
        )
    return localiser, wait_for_text(log, "running", localiser, MOST_WAIT_S)


def start_replay(args: argparse.Namespace) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [
            *(args.bins / "topoloc-replay", "--drive", args.drive, "--can", "can0=vcan0"),
            *("--lcm", LCM_URL, "--fifo", "50", "--json", args.work / "replay.json"),
            *args.replay,
        ]
    )


def before_others() -> None:
    """Lets the logger read before its 30 messages of queue are full; where that is allowed."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(20))


def start_logger(log: Path, channels: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        ["lcm-logger", "-q", "-c", channels, f"--lcm-url={LCM_URL}", str(log)],
        preexec_fn=before_others,
    )


class EstimateSampler:
    """Keeps every so manieth estimate. All of an hour's would be half a gigabyte."""

    def __init__(self, log: Path) -> None:
        self._lcm = lcm.LCM(LCM_URL)
        self._lcm.subscribe("TOPOLOC_ESTIMATE", self._take)
        self._log: Any = lcm.EventLog(str(log), "w", overwrite=True)
        self._seen = 0

    def _take(self, channel: str, data: bytes) -> None:
        if self._seen % ESTIMATE_EVERY == 0:
            self._log.write_event(time.time_ns() // 1000, channel, data)
        self._seen += 1

    def listen_until(self, monotonic_s: float) -> None:
        while (left_s := monotonic_s - time.monotonic()) > 0:
            self._lcm.handle_timeout(max(1, int(1e3 * left_s)))

    def close(self) -> None:
        self._log.close()


def held(process: subprocess.Popen[bytes]) -> str:
    """Anonymous memory in kB, threads and open files of a process, comma-separated."""
    folder = Path("/proc") / str(process.pid)
    status = dict(
        line.split(":", 1) for line in (folder / "status").read_text().splitlines() if ":" in line
    )
    files = sum(1 for _ in (folder / "fd").iterdir())
    return f"{status['RssAnon'].split()[0]},{int(status['Threads'])},{files}"


def watch(args: argparse.Namespace, localiser: subprocess.Popen[bytes]) -> None:
    """Samples for --seconds, or until the localiser ends."""
    sampler = EstimateSampler(args.work / "estimates.lcm")
    begin_s = time.monotonic()
    with (args.work / "memory.csv").open("w", encoding="ascii") as out:
        out.write("seconds,rss_anon_kb,threads,files\n")
        for second in range(int(args.seconds)):
            sampler.listen_until(begin_s + second)
            if localiser.poll() is not None:
                break
            out.write(f"{time.monotonic() - begin_s:.3f},{held(localiser)}\n")
            out.flush()
    sampler.close()


class MachineWatch:
    """Whether the machine gives its processes time, whatever the localiser does: a process of
    highest priority that wants to wake up at the estimator's rate."""

    PERIOD_S = 0.005
    PROMPT_S = 0.001  # so late it may be without being held up

    def __init__(self, period_s: float = PERIOD_S) -> None:
        self._here, there = multiprocessing.Pipe()
        self._held_up_s = multiprocessing.RawValue("d")
        self._process = multiprocessing.Process(target=self._run, args=(there, period_s))
        self._process.start()
        self._here.recv()  # it watches

    @property
    def held_up_ms(self) -> float:
        """For how long it was held up so far; a little too short, as it tells by its wakes."""
        return 1e3 * float(self._held_up_s.value)

    def missed_share(self) -> float:
        """Share of the periods in which it did not wake up; ends it."""
        self._here.send(None)
        share: float = self._here.recv()
        self._process.join()
        return share

    def _run(self, parent: Connection, period_s: float) -> None:
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(95))
        begin = woken = time.monotonic()
        wakes = periods = 0
        parent.send(None)
        while not parent.poll():
            periods = max(periods + 1, int((time.monotonic() - begin) / period_s))
            due = begin + periods * period_s
            time.sleep(max(0.0, due - time.monotonic()))
            ready = max(due, woken)  # a period that began while it was held up does not count again
            woken = time.monotonic()
            if woken - ready > self.PROMPT_S:
                self._held_up_s.value += woken - ready
            wakes += 1
        parent.send(1.0 - wakes / max(1, periods))


class FrozenMatcher:
    """The localiser's matcher, halted in the middle of a match: that one never comes to its end."""

    PTRACE_SEIZE, PTRACE_INTERRUPT, WALL = 0x4206, 0x4207, 0x40000000

    def __init__(self, localiser: subprocess.Popen[bytes]) -> None:
        tasks = Path(f"/proc/{localiser.pid}/task")
        self._thread = next(
            int(task.name)
            for task in tasks.iterdir()
            if (task / "comm").read_text().strip() == "matcher"
        )
        self._wait_for_a_match(tasks)
        trace = ctypes.CDLL(None, use_errno=True).ptrace
        trace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
        for request in (self.PTRACE_SEIZE, self.PTRACE_INTERRUPT):
            if trace(request, self._thread, None, None) != 0:
                raise OSError(ctypes.get_errno(), "the matcher cannot be halted")

    def _wait_for_a_match(self, tasks: Path) -> None:
        """Until it has begun, at most 5 s. One found at work may be near its end, and a look for a
        frame that is not there is over at once."""
        slept = False
        until = time.monotonic() + 5.0
        while time.monotonic() < until:
            runs = self._runs(tasks)
            if runs and slept:
                time.sleep(0.003)
                if self._runs(tasks):
                    return
            slept = not runs
            time.sleep(0.001)

    def _runs(self, tasks: Path) -> bool:
        return (tasks / str(self._thread) / "stat").read_text().rpartition(")")[2].split()[0] == "R"

    def let_end(self) -> None:
        """To be called until the process has ended: who traces a thread has to wait for it."""
        with contextlib.suppress(ChildProcessError):
            os.waitpid(self._thread, os.WNOHANG | self.WALL)


def play(
    args: argparse.Namespace, localiser: subprocess.Popen[bytes]
) -> tuple[int, FrozenMatcher | None]:
    """To the end of the drive, or for --seconds. Exit code of the replay."""
    replay = start_replay(args)
    frozen_matcher = None
    if args.seconds is not None:
        watch(args, localiser)
        replay.send_signal(signal.SIGTERM)
    elif args.freeze_matcher_after is not None:
        with contextlib.suppress(subprocess.TimeoutExpired):
            replay.wait(args.freeze_matcher_after)
        if localiser.poll() is None:
            frozen_matcher = FrozenMatcher(localiser)
    return replay.wait(), frozen_matcher


def stop(
    localiser: subprocess.Popen[bytes], frozen_matcher: FrozenMatcher | None
) -> tuple[int, float, float]:
    """Exit code, how long it took to stop, and for how long of that the machine gave no time
    [ms]."""
    machine = MachineWatch(STOP_WATCH_PERIOD_S)
    begin, held_up_before_ms = time.monotonic(), machine.held_up_ms
    localiser.send_signal(signal.SIGTERM)
    while localiser.poll() is None and time.monotonic() < begin + MOST_WAIT_S:
        if frozen_matcher:
            frozen_matcher.let_end()
        time.sleep(0.002)
    stop_ms = 1e3 * (time.monotonic() - begin)
    held_up_ms = machine.held_up_ms - held_up_before_ms
    machine.missed_share()
    if localiser.poll() is None:
        localiser.kill()
    return localiser.wait(), stop_ms, held_up_ms


def finish(logger: subprocess.Popen[bytes], log: Path) -> None:
    """Ends the logger once it has written what is there."""
    until = time.monotonic() + 10.0
    before, size = -1, log.stat().st_size
    while size != before and time.monotonic() < until:
        time.sleep(0.3)
        before, size = size, log.stat().st_size
    logger.send_signal(signal.SIGINT)
    try:
        logger.wait(timeout=MOST_WAIT_S)
    except subprocess.TimeoutExpired:
        logger.kill()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--bins", type=Path, required=True)
    parser.add_argument("--localiser", type=Path, required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--config", type=Path, required=True, help="vehicle.yaml of the localiser")
    parser.add_argument("--map", type=Path, required=True)
    parser.add_argument("--drive", type=Path, required=True)
    parser.add_argument("--initial-pose", required=True)
    parser.add_argument("--seconds", type=float, help="a soak of so long; default: the whole drive")
    parser.add_argument(
        "--freeze-matcher-after",
        type=float,
        help="seconds of the replay: it hangs in a match then, until the localiser ends",
    )
    parser.add_argument(
        "--replay", nargs=argparse.REMAINDER, default=[], help="further options of the replay"
    )
    args = parser.parse_args()
    # Real-time priority and locked memory, as the service unit grants them.
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))

    channels = ".*" if args.seconds is None else "TOPOLOC_(STATUS|TIMING)"
    logger = start_logger(args.work / "log.lcm", channels)
    machine = MachineWatch()
    localiser, started = start_localiser(args)
    machine_missed_share = machine.missed_share()
    died = localiser.poll() is not None
    replay_exit = frozen_matcher = None
    if started:
        machine = MachineWatch()
        replay_exit, frozen_matcher = play(args, localiser)
        machine_missed_share = machine.missed_share()
    time.sleep(0.5 if machine_missed_share <= MAX_MACHINE_MISSED else 3.0)  # for what is on its way
    localiser_exit, stop_ms, stop_held_up_ms = stop(localiser, frozen_matcher)
    finish(logger, args.work / "log.lcm")
    result = {
        "started": started,
        "died_at_the_start": died,
        "localiser_exit": localiser_exit,
        "replay_exit": replay_exit,
        "stop_ms": stop_ms,
        "stop_held_up_ms": stop_held_up_ms,
        "machine_missed_share": machine_missed_share,
    }
    (args.work / "run.json").write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()

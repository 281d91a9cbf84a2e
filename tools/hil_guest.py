#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The part of the HIL bench that needs CAN: localiser, replay and lcm-logger as processes.

Runs inside tools/with-vcan. Everything the processes say goes into --work: log.lcm (what was on
LCM), localiser.log, replay.json, journal/, run.json (exit codes, times).
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import resource
import signal
import subprocess
import time
from pathlib import Path

LCM_URL = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4000000"


def wait_for_text(log: Path, text: str, process: subprocess.Popen[bytes], timeout_s: float) -> None:
    until = time.monotonic() + timeout_s
    while text not in log.read_text():
        if process.poll() is not None or time.monotonic() > until:
            raise SystemExit(f"hil: the localiser did not start:\n{log.read_text()}")
        time.sleep(0.05)


def before_others() -> None:
    """Lets the logger read before its 30 messages of queue are full; where that is allowed."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(20))


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
    parser.add_argument(
        "--replay", nargs=argparse.REMAINDER, default=[], help="further options of the replay"
    )
    args = parser.parse_args()
    # Real-time priority and locked memory, as the service unit grants them.
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))

    logger = subprocess.Popen(
        ["lcm-logger", "-q", f"--lcm-url={LCM_URL}", str(args.work / "log.lcm")],
        preexec_fn=before_others,
    )
    localiser_log = args.work / "localiser.log"
    with localiser_log.open("wb") as out:
        localiser = subprocess.Popen(
            [
                *(args.localiser, "--config", args.config, "--map", args.map),
                *("--can", "can0=vcan0", "--lcm", LCM_URL, "--journal", args.work / "journal"),
                f"--initial-pose={args.initial_pose}",
            ],
            stdout=out,
            stderr=subprocess.STDOUT,
        )
    wait_for_text(localiser_log, "running", localiser, 60.0)
    replay = subprocess.run(
        [
            *(args.bins / "topoloc-replay", "--drive", args.drive, "--can", "can0=vcan0"),
            *("--lcm", LCM_URL, "--fifo", "50", "--json", args.work / "replay.json"),
            *args.replay,
        ],
        check=False,
    )
    time.sleep(0.5)  # what is on its way arrives
    begin = time.monotonic()
    localiser.send_signal(signal.SIGTERM)
    localiser_exit = localiser.wait(timeout=10.0)
    stop_ms = 1e3 * (time.monotonic() - begin)
    time.sleep(0.3)
    logger.send_signal(signal.SIGINT)
    logger.wait(timeout=10.0)
    result = {
        "localiser_exit": localiser_exit,
        "replay_exit": replay.returncode,
        "stop_ms": stop_ms,
    }
    (args.work / "run.json").write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()

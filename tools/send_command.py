#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Tells a running vehicle process where the vehicle is, or to stop, over LCM.

A pose is T_world_imu in the map's world frame, as `topoloc-localise --initial-pose` takes it; the
vehicle has to stand there. Run it with the project's Python: .venv/bin/python.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from pathlib import Path
from typing import Any

import lcm

from lcm_types import message_types

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"
EXAMPLES = """examples:
  .venv/bin/python tools/send_command.py pose "12.5 -3.1 0.2 0 0 0.7071068 0.7071068"
  .venv/bin/python tools/send_command.py stop --lcm "udpm://239.255.76.67:7667?ttl=1\""""


def pose_numbers(text: str) -> list[float]:
    numbers = [float(word) for word in text.split()]
    if len(numbers) != 7 or not all(map(math.isfinite, numbers)):
        raise argparse.ArgumentTypeError(f"'{text}' is not \"x y z qx qy qz qw\"")
    if abs(math.hypot(*numbers[3:]) - 1.0) > 1e-3:
        raise argparse.ArgumentTypeError(f"'{text}': the quaternion's length is not 1")
    return numbers


def initial_pose(types: Any, pose: list[float]) -> Any:
    """The message of a vehicle that stands at x y z qx qy qz qw."""
    message = types.initial_pose_t()
    message.utime = 0  # now
    message.position = pose[:3]
    message.orientation = [pose[6], *pose[3:6]]  # the message has w first
    return message


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    pose = commands.add_parser("pose", help="where the vehicle stands now")
    pose.add_argument("pose", type=pose_numbers, help='"x y z qx qy qz qw", metres')
    pose.add_argument("--channel", default="TOPOLOC_INITIAL_POSE", help="default: %(default)s")
    stop = commands.add_parser("stop", help="end the process, with a last status")
    stop.add_argument("--channel", default="TOPOLOC_COMMAND", help="default: %(default)s")
    for command in (pose, stop):
        command.add_argument("--lcm", default=DEFAULT_URL, help="LCM URL (default: %(default)s)")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        types = message_types(Path(folder))
        if args.command == "pose":
            message = initial_pose(types, args.pose)
        else:
            message = types.command_t()
            message.command = types.command_t.STOP
    lcm.LCM(args.lcm).publish(args.channel, message.encode())
    print(f"sent on {args.channel}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""tools/send_command.py says what topoloc-localise --initial-pose would."""

import argparse
from pathlib import Path

import pytest

from lcm_types import message_types
from send_command import initial_pose, pose_numbers


def test_the_quaternion_gets_into_the_order_of_the_message(tmp_path: Path) -> None:
    types = message_types(tmp_path)
    sent = initial_pose(types, pose_numbers("1 2 3 0.1 0.2 0.3 0.9273618"))
    received = types.initial_pose_t.decode(sent.encode())
    assert list(received.position) == [1.0, 2.0, 3.0]
    assert list(received.orientation) == [0.9273618, 0.1, 0.2, 0.3]
    assert received.utime == 0


@pytest.mark.parametrize("text", ["1 2 3", "1 2 3 0 0 0 0.5", "1 2 nan 0 0 0 1"])
def test_what_is_no_pose_is_refused(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match="1 2"):
        pose_numbers(text)

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""tools/hil.py: what of a run is held against the process, and what against the machine."""

import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from hil import Attempt, Checks, Published, check_ends, judge_attempts
from hil_guest import MAX_MACHINE_MISSED, MachineWatch

NO_TIME = 10 * MAX_MACHINE_MISSED


def attempt(stop_ms: float, held_up_ms: float, missed: float = 0.0) -> Attempt:
    ended: dict[str, Any] = {
        "started": True, "died_at_the_start": False, "localiser_exit": 0, "replay_exit": 0,
        "stop_ms": stop_ms, "stop_held_up_ms": held_up_ms, "machine_missed_share": missed,
    }  # fmt: skip
    return Attempt(Path(), ended)


def judged(of: Attempt, last_status: bool = True) -> Checks:
    published = SimpleNamespace(has_last_status=last_status, counters={"any": 1}, estimates=[None])
    checks = Checks()
    assert check_ends(checks, of, cast(Published, published))
    return checks


@pytest.mark.parametrize(
    ("stop_ms", "held_up_ms", "missed", "passed", "failed"),
    [
        (199.0, 0.0, 0.0, True, False),
        (199.0, 150.0, NO_TIME, True, False),
        (204.0, 0.0, 0.0, False, True),
        (204.0, 20.0, 0.0, False, True),  # so long its own end may hold up others
        (204.0, 23.0, 0.0, False, True),  # 201 ms of its own
        (204.0, 25.0, 0.0, False, False),
        (204.0, 0.0, NO_TIME, False, False),
        (900.0, 600.0, 0.0, False, True),
    ],
)
def test_stop(stop_ms: float, held_up_ms: float, missed: float, passed: bool, failed: bool) -> None:
    checks = judged(attempt(stop_ms, held_up_ms, missed))
    assert (checks.passed, checks.failed) == (passed, failed)


def test_missing_last_status_is_no_matter_of_the_stop_s_time() -> None:
    assert judged(attempt(204.0, 50.0), last_status=False).failed


def player(attempts: list[Attempt]) -> tuple[Callable[[], Attempt], list[Attempt]]:
    left = list(attempts)
    return lambda: left.pop(0), left


@pytest.mark.parametrize(
    ("attempts", "left", "exit_code"),
    [
        ([attempt(210.0, 50.0), attempt(100.0, 0.0), attempt(100.0, 0.0)], 1, 0),
        ([attempt(210.0, 50.0), attempt(210.0, 0.0), attempt(100.0, 0.0)], 1, 1),
        ([attempt(210.0, 50.0)] * 4, 1, 3),
        ([attempt(210.0, 0.0), attempt(100.0, 0.0)], 1, 1),
        ([attempt(210.0, 50.0, NO_TIME), attempt(100.0, 0.0, NO_TIME)], 0, 0),
    ],
)
def test_plays_again_what_could_not_be_judged(
    attempts: list[Attempt], left: int, exit_code: int
) -> None:
    play_once, unplayed = player(attempts)
    assert judge_attempts("run", play_once, judged, 60.0).finish(None) == exit_code
    assert len(unplayed) == left


def test_localiser_that_had_no_time_to_start_is_forgotten_once_it_starts() -> None:
    late = attempt(100.0, 0.0, NO_TIME)
    late.ended["started"] = False
    published = cast(Published, SimpleNamespace(has_last_status=False, counters={}, estimates=[]))

    def judge(of: Attempt) -> Checks:
        if of is late:
            checks = Checks()
            assert not check_ends(checks, of, published)
            return checks
        return judged(of)

    play_once, _ = player([late, attempt(100.0, 0.0)])
    assert judge_attempts("run", play_once, judge, 60.0).finish(None) == 0


def test_watch_sees_what_holds_it_up(monkeypatch: pytest.MonkeyPatch) -> None:
    sleep = time.sleep
    calls = iter(range(10**9))
    # The watch's process gets this, too: its tenth sleep takes 0.3 s more.
    monkeypatch.setattr(time, "sleep", lambda s: sleep(s + (0.3 if next(calls) == 10 else 0.0)))
    begin = time.monotonic()
    watch = MachineWatch(0.002)
    sleep(0.6)
    held_up_ms = watch.held_up_ms
    assert held_up_ms >= 299.0
    assert held_up_ms < 1e3 * (time.monotonic() - begin)
    assert watch.missed_share() > 0.1

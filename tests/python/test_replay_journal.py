# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""topoloc-localise --replay of journals that are not whole, or not taken as they are."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

import lcm
import pytest
from programs import run
from test_check import BIN, IMU, ROOT, VEHICLE

from lcm_types import message_types

TICKS = 200
PERIOD_NS = 5_000_000


def write_vehicle(folder: Path) -> Path:
    shutil.copy(ROOT / "config/topoloc_imu_wheel.dbc", folder)
    (folder / "imu.yaml").write_text(IMU)
    file = folder / "vehicle.yaml"
    file.write_text(VEHICLE)
    return file


def write_file(folder: Path, types: Any, number: int, *, first_tick: int, damage: int = 0) -> None:
    """Of a car that stands at x = 7. The run begins with tick 0, which has a pose with it."""
    folder.mkdir(exist_ok=True)
    log = lcm.EventLog(str(folder / f"journal_{number:06}.lcm"), "w", overwrite=True)
    start = types.journal_start_t()
    start.version, start.vehicle_yaml = "0", VEHICLE
    start.from_start = first_tick == 0
    start.has_pose = not start.from_start
    start.pose_ns = (first_tick - 1) * PERIOD_NS
    start.rotation, start.position = [1, 0, 0, 0, 1, 0, 0, 0, 1], [7, 0, 0]
    encoded = bytearray(start.encode())
    encoded[0] ^= damage
    log.write_event(0, "JOURNAL_START", bytes(encoded))
    for i in range(first_tick, first_tick + TICKS):
        tick = types.tick_t()
        tick.tick, tick.now_ns = i, i * PERIOD_NS
        imu, speed = types.imu_sample_t(), types.speed_sample_t()
        imu.time_ns = speed.time_ns = tick.now_ns
        imu.specific_force = [0, 0, 9.81]
        tick.nimu, tick.imu, tick.nspeed, tick.speed = 1, [imu], 1, [speed]
        tick.match_set = -1
        tick.has_initial_pose = i == 0
        tick.initial_pose_ns = tick.now_ns
        tick.initial_rotation, tick.initial_position = start.rotation, start.position
        log.write_event(tick.now_ns // 1000, "JOURNAL_TICK", tick.encode())
    log.close()


@pytest.fixture
def types(tmp_path: Path) -> Any:
    return message_types(tmp_path / "types")


@pytest.fixture
def journal(tmp_path: Path, types: Any) -> Path:
    """One file, in the middle of a run."""
    folder = tmp_path / "journal"
    write_file(folder, types, 9, first_tick=1000)
    return folder


def replay(
    journal: Path, vehicle: Path, *options: str, exact: bool = False
) -> subprocess.CompletedProcess[str]:
    program = str(BIN / "topoloc-localise")
    given = ("--config", str(vehicle), "--replay", str(journal), "--dead-reckoning", *options)
    result = run(program, *given, "--out", str(journal.parent / "replayed.tum"))
    assert result.returncode == 0, result.stderr
    assert ("not exact" in result.stderr) != exact
    assert (", exactly" in result.stdout) == exact
    return result


def x_of_replayed(journal: Path) -> list[float]:
    lines = (journal.parent / "replayed.tum").read_text().splitlines()
    return [float(line.split()[1]) for line in lines if not line.startswith("#")]


def test_it_starts_from_the_pose_that_the_journal_begins_with(journal: Path) -> None:
    replay(journal, write_vehicle(journal.parent))
    xs = x_of_replayed(journal)
    assert len(xs) > TICKS - 5
    assert xs == pytest.approx([7.0] * len(xs), abs=0.1)


def test_it_starts_from_a_pose_that_is_given(journal: Path) -> None:
    replay(journal, write_vehicle(journal.parent), "--initial-pose", "40 0 0 0 0 0 1")
    assert x_of_replayed(journal)[0] == pytest.approx(40.0, abs=0.1)


def test_a_pose_that_is_given_comes_before_that_of_the_run(tmp_path: Path, types: Any) -> None:
    journal = tmp_path / "journal"
    write_file(journal, types, 1, first_tick=0)
    vehicle = write_vehicle(tmp_path)
    replay(journal, vehicle, exact=True)
    assert x_of_replayed(journal)[-1] == pytest.approx(7.0, abs=0.1)
    replay(journal, vehicle, "--initial-pose", "40 0 0 0 0 0 1")
    xs = x_of_replayed(journal)
    assert xs == pytest.approx([40.0] * len(xs), abs=0.1)


def test_a_file_that_is_missing_in_the_middle_is_said(tmp_path: Path, types: Any) -> None:
    journal = tmp_path / "journal"
    for number in (1, 2, 4):
        write_file(journal, types, number, first_tick=(number - 1) * TICKS)
    result = replay(journal, write_vehicle(tmp_path))
    assert "1 files missing" in result.stderr
    assert x_of_replayed(journal)[-1] == pytest.approx(7.0, abs=0.1)


def test_a_journal_of_another_version_is_called_that(tmp_path: Path, types: Any) -> None:
    journal = tmp_path / "journal"
    write_file(journal, types, 1, first_tick=0, damage=1)
    result = replay(journal, write_vehicle(tmp_path))
    assert "another version of topoloc" in result.stderr
    assert "middle of a run" not in result.stderr
    assert "recorded with" not in result.stderr


def test_estimates_are_written_although_the_vehicle_does_not_publish_them(journal: Path) -> None:
    vehicle = write_vehicle(journal.parent)
    vehicle.write_text(VEHICLE.replace('ttl=0"}', 'ttl=0", channels: {estimate: ""}}'))
    replay(journal, vehicle)
    log = lcm.EventLog(str(journal.parent / "replayed.lcm"))
    assert {event.channel for event in log} == {"TOPOLOC_ESTIMATE"}

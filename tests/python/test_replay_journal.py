# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""topoloc-localise --replay of a journal whose first files are gone."""

import shutil
import subprocess
from pathlib import Path

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


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    """Of a car that stands at x = 7: one file, in the middle of a run."""
    types = message_types(tmp_path / "types")
    folder = tmp_path / "journal"
    folder.mkdir()
    log = lcm.EventLog(str(folder / "journal_000009.lcm"), "w", overwrite=True)
    start = types.journal_start_t()
    start.version, start.vehicle_yaml = "0", VEHICLE
    start.has_pose = True
    start.rotation, start.position = [1, 0, 0, 0, 1, 0, 0, 0, 1], [7, 0, 0]
    log.write_event(0, "JOURNAL_START", start.encode())
    for i in range(TICKS):
        tick = types.tick_t()
        tick.tick, tick.now_ns = 1000 + i, i * PERIOD_NS
        imu, speed = types.imu_sample_t(), types.speed_sample_t()
        imu.time_ns = speed.time_ns = tick.now_ns
        imu.specific_force = [0, 0, 9.81]
        tick.nimu, tick.imu, tick.nspeed, tick.speed = 1, [imu], 1, [speed]
        tick.match_set = -1
        log.write_event(tick.now_ns // 1000, "JOURNAL_TICK", tick.encode())
    log.close()
    return folder


def replay(journal: Path, vehicle: Path, *options: str) -> subprocess.CompletedProcess[str]:
    program = str(BIN / "topoloc-localise")
    given = ("--config", str(vehicle), "--replay", str(journal), "--dead-reckoning", *options)
    result = run(program, *given, "--out", str(journal.parent / "replayed.tum"))
    assert result.returncode == 0, result.stderr
    assert "not exact" in result.stderr
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


def test_estimates_are_written_although_the_vehicle_does_not_publish_them(journal: Path) -> None:
    vehicle = write_vehicle(journal.parent)
    vehicle.write_text(VEHICLE.replace('ttl=0"}', 'ttl=0", channels: {estimate: ""}}'))
    replay(journal, vehicle)
    log = lcm.EventLog(str(journal.parent / "replayed.lcm"))
    assert {event.channel for event in log} == {"TOPOLOC_ESTIMATE"}

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The vehicle process starts without its flight recorder, and not once it was told to end."""

import subprocess
import sys
from pathlib import Path

import pytest
from programs import run
from test_check import BIN, ROOT, VEHICLE
from test_check import vehicle as vehicle  # a fixture

# A signal that waits when the program begins: as one that comes while it reads models and map.
TOLD_TO_END = """\
import os, signal, sys
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM])
os.kill(os.getpid(), signal.SIGTERM)
os.execv(sys.argv[1], sys.argv[1:])
"""

TOLD_TO_END_ONCE_IT_RUNS = """\
import subprocess, sys
program = subprocess.Popen(sys.argv[1:], stdout=subprocess.PIPE, text=True)
for line in program.stdout:
    print(line, end="")
    if line.startswith("running"):
        program.terminate()
sys.exit(program.wait())
"""


def localise(vehicle: Path, journal: str, *before: str) -> subprocess.CompletedProcess[str]:
    vehicle.write_text(VEHICLE.replace("no0", "vcan0"))
    options = ("--dead-reckoning", "--lcm", "memq://", "--journal", journal)
    program = (str(BIN / "topoloc-localise"), "--config", str(vehicle), *options)
    result = run(ROOT / "tools/with-vcan", "--", *before, *program)
    if result.returncode == 125:
        pytest.skip(result.stderr)
    assert result.returncode == 0, result.stdout + result.stderr
    return result


def test_a_journal_that_cannot_be_written_stops_nothing(vehicle: Path) -> None:
    result = localise(vehicle, "/proc/flight", sys.executable, "-c", TOLD_TO_END_ONCE_IT_RUNS)
    said = result.stdout + result.stderr
    assert "/proc/flight: cannot be used for the journal" in said
    assert "running" in said
    assert "stopped: " in said


def test_a_signal_before_the_start_is_obeyed_and_moves_no_journal(vehicle: Path) -> None:
    journal = vehicle.parent / "flight"
    result = localise(vehicle, str(journal), sys.executable, "-c", TOLD_TO_END)
    assert "stopped before the start" in result.stdout
    assert "running" not in result.stdout
    assert not journal.exists()

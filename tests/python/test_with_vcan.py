# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""tools/with-vcan: what the command sees, and what stays behind."""

import contextlib
import os
import subprocess
from pathlib import Path

import pytest
from programs import run

ROOT = Path(__file__).resolve().parents[2]
WITH_VCAN = ROOT / "tools/with-vcan"


@pytest.fixture(scope="module", autouse=True)
def _possible() -> None:
    where = run(WITH_VCAN, "--where")
    if where.returncode == 125:
        pytest.skip(where.stderr)
    assert where.stdout in ("machine\n", "uml\n")


def test_interfaces_output_and_exit_code() -> None:
    script = "ip -br link show type vcan; pwd; echo $TOPOLOC_VCAN $ADDED; exit 7"
    result = subprocess.run(
        [WITH_VCAN, "--interfaces", "can0,imu0", "sh", "-c", script],
        capture_output=True,
        text=True,
        check=False,
        cwd="/usr",
        env=os.environ | {"ADDED": "a  b"},
    )
    assert result.returncode == 7
    lines = result.stdout.splitlines()
    assert [line.split()[0] for line in lines[:2]] == ["can0", "imu0"]
    assert lines[2] == "/usr"
    assert lines[3].split()[0] in ("machine", "uml")


def running_commands() -> list[bytes]:
    commands = []
    for process in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):  # it may have ended meanwhile
            commands.append(process.read_bytes())
    return commands


def test_time_limit_and_nothing_left(tmp_path: Path) -> None:
    result = subprocess.run(
        [WITH_VCAN, "--timeout", "1", "sleep", "4711"],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"TMPDIR": str(tmp_path)},
    )
    assert result.returncode == 124
    assert list(tmp_path.iterdir()) == []
    assert not any(str(tmp_path).encode() in command for command in running_commands())


def test_wrong_usage() -> None:
    for arguments in (["--interfaces", "a b", "true"], ["--timeout", "x", "true"], ["--no"], []):
        result = run(WITH_VCAN, *arguments)
        assert result.returncode == 2, arguments
        assert "--help" in result.stderr

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Running the programs under test."""

import subprocess
from pathlib import Path


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)


def done(*command: str | Path) -> str:
    """What it printed; the test fails if it failed."""
    result = run(*command)
    assert result.returncode == 0, result.stderr
    return result.stdout

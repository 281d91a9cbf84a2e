# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Which build of a program is at work: its checksum and those of the libraries it loads."""

from __future__ import annotations

import hashlib
import subprocess
from functools import cache
from modulefinder import ModuleFinder
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Libraries of the system are not looked at: they come with it.
OWN = (ROOT, (ROOT / "third_party/cache").resolve())


def file_checksum(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "none"


# As the file was when this run began.
first_checksum = cache(file_checksum)


@cache
def libraries(program: Path) -> tuple[Path, ...]:
    """Shared libraries that it loads from within the project's tree; none where ldd cannot tell."""
    try:
        told = subprocess.run(["ldd", str(program)], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ()
    words = [line.split() for line in told.stdout.splitlines() if " => /" in line]
    found = [Path(line[2]).resolve() for line in words]
    return tuple(path for path in found if any(path.is_relative_to(tree) for tree in OWN))


@cache
def imports(script: Path) -> tuple[Path, ...]:
    """Modules beside a Python script that it imports, and theirs; the environment's are not looked
    at."""
    finder = ModuleFinder([str(script.parent)])
    try:
        finder.run_script(str(script))
    except (OSError, SyntaxError):  # running it will say so
        return ()
    files = (vars(module)["__file__"] for module in finder.modules.values())
    return tuple(sorted({Path(file) for file in files if file} - {script}))


def parts(program: Path) -> tuple[Path, ...]:
    """What makes its results: itself, and its libraries or modules."""
    return (program, *(imports(program) if program.suffix == ".py" else libraries(program)))

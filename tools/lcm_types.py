# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The project's LCM types (lcmtypes/) for the Python tools."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

from accuracy_table import run

ROOT = Path(__file__).resolve().parent.parent


def message_types(folder: Path) -> Any:
    """The project's LCM types for Python, generated into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    types = sorted((ROOT / "lcmtypes").glob("*.lcm"))
    run("lcm-gen", "--python", "--ppath", folder, *types)
    sys.path.insert(0, str(folder))
    return importlib.import_module("topoloc")

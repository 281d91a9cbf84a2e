# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""tools/export_models.py beside what it exports, which test_models.py is about."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def export(*options: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, ROOT / "tools/export_models.py", *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_a_second_export_does_nothing(small_models: Callable[[], Path]) -> None:
    folder = small_models()
    before = {p.name: p.stat().st_mtime_ns for p in folder.iterdir()}
    options = "--models disk --sizes 320x192 --features 256 --models-dir"
    again = export(*options.split(), folder)
    assert again.returncode == 0
    assert "up to date" in again.stdout
    assert {p.name: p.stat().st_mtime_ns for p in folder.iterdir()} == before


def test_a_size_that_a_network_cannot_take_is_refused(tmp_path: Path) -> None:
    options = "--models aliked-n16 --sizes 330x192 --models-dir"
    result = export(*options.split(), tmp_path)
    assert result.returncode == 1
    assert "330x192" in result.stderr
    assert not list(tmp_path.glob("*.onnx"))


def test_an_unknown_model_is_refused_with_those_there_are() -> None:
    result = export("--models", "superpoint")
    assert result.returncode == 2
    assert "aliked-n16" in result.stderr

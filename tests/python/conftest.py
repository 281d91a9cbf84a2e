# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Models that several tests use."""

import functools
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from programs import done

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def models() -> Path:
    """Folder of the default models."""
    return Path(os.environ.get("TOPOLOC_MODELS", ROOT / "third_party/cache/models"))


@pytest.fixture(scope="session")
def kitti_0039(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Drive folder of KITTI 2011_09_26_drive_0039, to be read only."""
    data = Path(os.environ.get("TOPOLOC_DATA", ROOT / ".." / "shared" / "data"))
    drive = tmp_path_factory.mktemp("kitti_0039") / "drive"
    done(ROOT / "tools/topoloc-import", "kitti-0039", data / "kitti_0039", "--out", drive)
    return drive


@pytest.fixture(scope="session")
def small_models() -> Callable[[], Path]:
    """Makes the folder of the other models for 320x192 pixels and 256 features: that is quick, and
    quicker the second time, for the folder stays. Fails if the exporter's own checks do."""

    @functools.cache
    def export() -> Path:
        folder = ROOT / "build/small-models"
        options = "--models aliked-n16 disk --sizes 320x192 --features 256 --models-dir"
        script = ROOT / "tools/export_models.py"
        result = subprocess.run(
            [sys.executable, script, *options.split(), folder],
            capture_output=True,
            text=True,
            check=False,
        )
        assert result.returncode == 0, result.stdout + result.stderr
        return folder

    return export

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""From the KITTI raw layout to a trajectory: README's four commands on drive 0009, the map from the
even frames, the odd frames localised in it. And what the programs say to bad input."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("TOPOLOC_DATA", ROOT / ".." / "shared" / "data")) / "kitti_0009"
BIN = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin"))

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"{DATA} is not there")


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)


def done(*command: str | Path) -> str:
    result = run(*command)
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with `drive`, imported, and `map.tmap`."""
    folder = tmp_path_factory.mktemp("kitti_0009")
    drive = folder / "drive"
    done(ROOT / "tools" / "topoloc-import", "kitti-raw", DATA / "2011_09_26", "--out", drive,
         "--cloud")  # fmt: skip
    done(BIN / "topoloc-map", "build", "--drive", drive, "--cloud", drive / "cloud.ply",
         "--trajectory", drive / "ground_truth.tum", "--frames", "even",
         "--out", folder / "map.tmap")  # fmt: skip
    return folder


def localise(work: Path, map_file: Path) -> subprocess.CompletedProcess[str]:
    return run(BIN / "topoloc-localise", "--drive", work / "drive", "--map", map_file,
               "--frames", "odd", "--out", work / "estimate.tum")  # fmt: skip


def test_raw_drive_becomes_a_trajectory(work: Path) -> None:
    assert localise(work, work / "map.tmap").returncode == 0
    figures = json.loads(
        done(BIN / "topoloc-evaluate", "--reference", work / "drive" / "ground_truth.tum",
             "--estimate", work / "estimate.tum", "--from-seconds", "1", "--json", "-")
    )  # fmt: skip
    assert figures["coverage"] >= 0.99
    assert figures["apet_m"] <= 0.15
    assert figures["aper_rad"] <= 0.004


def test_stripped_map_localises_to_the_same_bytes(work: Path) -> None:
    assert localise(work, work / "map.tmap").returncode == 0
    with_images = (work / "estimate.tum").read_bytes()
    done(BIN / "topoloc-map", "strip", work / "map.tmap", "--out", work / "stripped.tmap")
    assert (work / "stripped.tmap").stat().st_size <= 13 * 40_000 + 8192
    assert localise(work, work / "stripped.tmap").returncode == 0
    assert (work / "estimate.tum").read_bytes() == with_images


@pytest.mark.parametrize("damage", ["truncated", "flipped"])
def test_damaged_map_is_a_clear_error(work: Path, damage: str) -> None:
    content = bytearray((work / "map.tmap").read_bytes())
    if damage == "truncated":
        content = content[: len(content) // 2]
    else:
        content[100] ^= 1
    (work / "damaged.tmap").write_bytes(content)
    result = localise(work, work / "damaged.tmap")
    assert result.returncode == 1
    assert "damaged.tmap" in result.stderr
    assert run(BIN / "topoloc-map", "verify", work / "damaged.tmap").returncode == 1


def test_map_of_another_model_is_refused(work: Path) -> None:
    vehicle = work / "drive" / "vehicle_1024.yaml"
    text = (work / "drive" / "vehicle.yaml").read_text()
    vehicle.write_text(text + "matching:\n  max_features: 1024\n")
    result = run(BIN / "topoloc-localise", "--drive", work / "drive", "--vehicle", vehicle,
                 "--map", work / "map.tmap", "--out", work / "estimate.tum")  # fmt: skip
    assert result.returncode == 1
    assert "model" in result.stderr


def test_unknown_config_key_names_file_line_and_key(work: Path) -> None:
    vehicle = work / "drive" / "vehicle_typo.yaml"
    text = (work / "drive" / "vehicle.yaml").read_text()
    vehicle.write_text(text + "matching:\n  max_featurs: 512\n")
    result = run(BIN / "topoloc-localise", "--drive", work / "drive", "--vehicle", vehicle,
                 "--map", work / "map.tmap", "--out", work / "estimate.tum")  # fmt: skip
    assert result.returncode == 1
    line = len(text.splitlines()) + 2
    assert f"vehicle_typo.yaml:{line}" in result.stderr
    assert "max_featurs" in result.stderr


def test_dbc_without_the_signals_is_refused(work: Path) -> None:
    dbc = work / "drive" / "other.dbc"
    dbc.write_text('VERSION ""\n\nBU_: X\n\nBO_ 5 OTHER: 8 X\n SG_ A : 0|8@1+ (1,0) [0|0] "" X\n')
    vehicle = work / "drive" / "vehicle_dbc.yaml"
    text = (work / "drive" / "vehicle.yaml").read_text()
    vehicle.write_text(text.replace("topoloc_imu_wheel.dbc", "other.dbc"))
    result = run(BIN / "topoloc-localise", "--drive", work / "drive", "--vehicle", vehicle,
                 "--map", work / "map.tmap", "--out", work / "estimate.tum")  # fmt: skip
    assert result.returncode == 1
    assert "IMU_ACCEL" in result.stderr

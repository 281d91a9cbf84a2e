# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Dead reckoning on a real car: wheel speeds from its bus and a phone's IMU, calibrated on the
first 10 s of reference, then 50 s without any (docs/dead-reckoning.md)."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from topoloc_import.cli import main as import_drive

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("TOPOLOC_DATA", ROOT.parent / "shared" / "data")) / "comma2k19_example"
BIN = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin"))
CALIBRATION_S = "10"

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"{DATA} is not there")


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The imported drive, with calibrated.yaml from its first 10 s."""
    folder = tmp_path_factory.mktemp("comma2k19") / "drive"
    assert import_drive(["comma2k19", str(DATA), "--out", str(folder)]) == 0
    run(
        "topoloc-calibrate", "vehicle", "--drive", folder, "--until-seconds", CALIBRATION_S,
        "--out", folder / "calibrated.yaml", "--json", folder / "calibration.json",
    )  # fmt: skip
    return folder


def run(program: str, *arguments: str | Path) -> str:
    """Runs a program; returns what it printed."""
    command = [BIN / program, *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def reckon(drive: Path, vehicle: Path) -> dict[str, float]:
    """Dead reckoning from 10 s on, judged against the reference."""
    estimate = drive / f"{vehicle.stem}.tum"
    run(
        "topoloc-localise", "--drive", drive, "--vehicle", vehicle, "--dead-reckoning",
        "--start-seconds", CALIBRATION_S, "--out", estimate,
    )  # fmt: skip
    figures = run(
        "topoloc-evaluate", "--reference", drive / "ground_truth.tum", "--estimate", estimate,
        "--from-seconds", CALIBRATION_S, "--json", "-",
    )  # fmt: skip
    result: dict[str, float] = json.loads(figures)
    return result


def test_calibration_finds_wheel_scale_and_turn_on_bias(drive: Path) -> None:
    calibration = json.loads((drive / "calibration.json").read_text())
    assert calibration["wheel_scale"]["observable"]
    assert calibration["vehicle"]["wheel_scale"] == pytest.approx(1 / 0.9916, abs=0.005)
    # Android's own estimate of this bias is in the source: -0.0098, -0.0351, 0.0684 rad/s about
    # forward, right, down.
    assert calibration["imu"]["gyro_bias_radps"] == pytest.approx(
        [-0.0098, 0.0351, -0.0684], abs=0.003
    )


def test_drifts_less_than_one_and_a_half_percent_of_the_way(drive: Path) -> None:
    figures = reckon(drive, drive / "calibrated.yaml")
    assert figures["travelled_m"] > 800
    assert figures["coverage"] > 0.99
    assert figures["final_horizontal_m"] <= 0.015 * figures["travelled_m"]
    assert figures["max_horizontal_m"] <= 0.015 * figures["travelled_m"]


def test_calibration_is_what_makes_it_so(drive: Path) -> None:
    assert (
        reckon(drive, drive / "vehicle.yaml")["max_horizontal_m"]
        > 5 * reckon(drive, drive / "calibrated.yaml")["max_horizontal_m"]
    )


def test_without_camera_a_map_cannot_be_used(drive: Path) -> None:
    assert "no section 'camera'" in complaint(drive, "--map", str(drive / "no.tmap"))


def test_start_beyond_the_end_is_an_error(drive: Path) -> None:
    assert "the drive ends before" in complaint(drive, "--dead-reckoning", "--start-seconds", "61")


def complaint(drive: Path, *arguments: str) -> str:
    """What topoloc-localise says when it fails."""
    command = [str(BIN / "topoloc-localise"), "--drive", str(drive), "--out", str(drive / "no.tum")]
    failed = subprocess.run([*command, *arguments], check=False, capture_output=True, text=True)
    assert failed.returncode == 1
    return failed.stderr

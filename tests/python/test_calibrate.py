# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""topoloc-calibrate on a KITTI drive: what the drive does not show stays as the vehicle.yaml says,
and the file that it writes can be used where it lies."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("TOPOLOC_DATA", ROOT.parent / "shared" / "data")) / "kitti_oxts"
BIN = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin"))
OXTS = DATA / "2011_09_26_drive_0101.csv.gz"
ROLL_RAD, LEVER_M, WHEEL_SCALE = 0.02, [0.1, 0.3, -0.4], 1.01
VEHICLE = f"""\
format: 1
can:
  dbc: car.dbc
  wheels: {{speeds: [WHEELS.SPEED]}}
imu: {{calibration: imu.yaml}}
vehicle:
  rotation_vehicle_imu_rpy_rad: [{ROLL_RAD}, 0, 0]
  wheel_reference_imu_m: {LEVER_M}
  wheel_scale: {WHEEL_SCALE}
"""
IMU = """\
accelerometer_noise_density: 0.01
accelerometer_random_walk: 0.0002
gyroscope_noise_density: 0.005
gyroscope_random_walk: 4.0e-06
update_rate: 100.0
"""

pytestmark = pytest.mark.skipif(not OXTS.is_file(), reason=f"{OXTS} is not there")


def calibrate(vehicle: Path, out: Path) -> None:
    subprocess.run(
        [
            BIN / "topoloc-calibrate", "vehicle", "--oxts", OXTS, "--vehicle", vehicle,
            "--out", out,
        ],
        check=True,
        capture_output=True,
    )  # fmt: skip


@pytest.fixture
def vehicle(tmp_path: Path) -> Path:
    folder = tmp_path / "vehicle"
    folder.mkdir()
    (folder / "vehicle.yaml").write_text(VEHICLE)
    (folder / "imu.yaml").write_text(IMU)
    (folder / "car.dbc").touch()
    return folder / "vehicle.yaml"


def test_what_the_drive_does_not_show_stays_as_given(vehicle: Path, tmp_path: Path) -> None:
    calibrate(vehicle, tmp_path / "calibrated.yaml")
    mounting = yaml.safe_load((tmp_path / "calibrated.yaml").read_text())["vehicle"]
    roll_rad, pitch_rad, _ = mounting["rotation_vehicle_imu_rpy_rad"]
    assert roll_rad == pytest.approx(ROLL_RAD, abs=1e-6)
    assert pitch_rad == pytest.approx(0.0086, abs=0.002), "the drive shows it"
    # Given in IMU axes, which pitch and yaw have turned by less than 10 mrad.
    assert mounting["wheel_reference_imu_m"] == pytest.approx(LEVER_M, abs=0.01)
    assert mounting["wheel_scale"] == WHEEL_SCALE


def test_calibrated_file_is_usable_in_another_folder(vehicle: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "calibrated"
    elsewhere.mkdir()
    calibrate(vehicle, elsewhere / "once.yaml")
    written = yaml.safe_load((elsewhere / "once.yaml").read_text())
    assert written["imu"]["calibration"] == "../vehicle/imu.yaml"
    assert (elsewhere / written["can"]["dbc"]).is_file()
    calibrate(elsewhere / "once.yaml", elsewhere / "twice.yaml")

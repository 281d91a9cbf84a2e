# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The comma2k19 importer: two buses in one log, axes and world frame."""

from __future__ import annotations

from pathlib import Path

import cantools
import numpy as np
import pytest
from cantools.database.can import Database

from topoloc_import.cli import main
from topoloc_import.drive_folder import DBC
from topoloc_import.geodesy import latitude_longitude, rotation_enu_ecef

CAR_DBC = """VERSION ""
BU_: X
BO_ 170 WHEEL_SPEEDS: 8 X
 SG_ WHEEL_SPEED_FR : 6|15@0+ (0.01,-67.67) [0|0] "km/h" X
"""
WANTED = "(0000000100.005000) can0 0AA#1A6F1A6F1A6F1A6F\n"
CAN_LOG = (
    "(0000000100.001000) can0 123#00\n"  # not in the DBC
    + WANTED
    + "(0000000100.006000) can1 0AA#0000000000000000\n"  # another bus
    + "(0000000100.007000) can128 0AA#0000000000000000\n"  # sent, not received
)
IMU = """timestamp_ns,ax_mps2,ay_mps2,az_mps2,wx_uncalibrated_radps,wy_uncalibrated_radps,wz_uncalibrated_radps
100000000400,1.0,2.0,-9.8,0.1,0.2,0.3
100010000600,1.0,2.0,-9.8,0.1,0.2,0.3
"""  # noqa: E501
# On the equator at longitude 0: up = x, east = y, north = z of ECEF. Forward, right, down point
# north, east, down: the quaternion turns x to z, y to y, z to -x.
HALF = float(np.sqrt(0.5))
POSES = f"""timestamp_ns,x_ecef_m,y_ecef_m,z_ecef_m,qw,qx,qy,qz
100000000000,6378137.0,0.0,0.0,{HALF},0.0,{-HALF},0.0
100050000000,6378138.0,2.0,3.0,{HALF},0.0,{-HALF},0.0
"""


@pytest.fixture
def segment(tmp_path: Path) -> Path:
    """A source folder with one frame that counts, two IMU samples and two poses."""
    folder = tmp_path / "segment"
    folder.mkdir()
    (folder / "toyota_wheel_speeds.dbc").write_text(CAR_DBC)
    (folder / "can.log").write_text(CAN_LOG)
    (folder / "imu.csv").write_text(IMU)
    (folder / "global_pose.csv").write_text(POSES)
    return folder


def run(source: Path) -> int:
    return main(["comma2k19", str(source), "--out", str(source.with_name("drive"))])


def test_log_holds_the_cars_frames_unchanged_between_those_of_the_imu(segment: Path) -> None:
    assert run(segment) == 0
    lines = (segment.with_name("drive") / "can.log").read_text().splitlines(keepends=True)
    assert lines[2] == WANTED
    assert [line.split()[1] for line in lines] == ["imu0", "imu0", "can0", "imu0", "imu0"]
    assert lines[0].startswith("(0000000100.000000) ")
    assert lines[3].startswith("(0000000100.010001) ")


def test_imu_looks_forward_left_up(segment: Path) -> None:
    assert run(segment) == 0
    drive = segment.with_name("drive")
    database = cantools.database.load_file(drive / DBC.name, strict=True)
    assert isinstance(database, Database)
    payloads = [line.split("#")[1] for line in (drive / "can.log").read_text().split()[2::3][:2]]
    accel = database.decode_message("IMU_ACCEL", bytes.fromhex(payloads[0]))
    rate = database.decode_message("IMU_RATE", bytes.fromhex(payloads[1]))
    assert isinstance(accel, dict) and isinstance(rate, dict)
    assert [accel[f"ACCEL_{a}"] for a in "XYZ"] == pytest.approx([1.0, -2.0, 9.8], abs=2e-4)
    assert [rate[f"RATE_{a}"] for a in "XYZ"] == pytest.approx([0.1, -0.2, -0.3], abs=2e-5)


def test_truth_is_east_north_up_from_the_first_pose(segment: Path) -> None:
    assert run(segment) == 0
    truth = np.loadtxt(segment.with_name("drive") / "ground_truth.tum")
    assert truth[0, 1:4] == pytest.approx([0, 0, 0])
    assert truth[1, 1:4] == pytest.approx([2, 3, 1])
    assert truth[0, 4:] == pytest.approx([0, 0, HALF, HALF], abs=1e-6)  # faces north


def test_geodesy_agrees_with_its_inverse() -> None:
    latitude, longitude, height = np.radians(37.72), np.radians(-122.47), 33.0
    e2 = (2 - 1 / 298.257223563) / 298.257223563
    normal = 6378137.0 / np.sqrt(1 - e2 * np.sin(latitude) ** 2)
    up = np.array(
        [
            np.cos(latitude) * np.cos(longitude),
            np.cos(latitude) * np.sin(longitude),
            np.sin(latitude),
        ]
    )
    point = up * (normal + height) - [0, 0, e2 * normal * np.sin(latitude)]
    assert latitude_longitude(point) == pytest.approx((latitude, longitude), abs=1e-12)
    assert rotation_enu_ecef(point) @ up == pytest.approx([0, 0, 1])


@pytest.mark.parametrize(
    ("file", "text", "complaint"),
    [
        ("imu.csv", IMU.replace("0.3\n", "nan\n", 1), "imu.csv:2"),
        ("imu.csv", IMU.replace("100010000600", "100000000400"), "imu.csv:3"),
        ("imu.csv", IMU.replace("az_mps2", "az"), "az_mps2"),
        ("can.log", "hello\n", "can.log:1"),
        ("global_pose.csv", "timestamp_ns\n", "fewer than two rows"),
    ],
)
def test_bad_sources_are_named(
    segment: Path, capsys: pytest.CaptureFixture[str], file: str, text: str, complaint: str
) -> None:
    (segment / file).write_text(text)
    assert run(segment) == 1
    assert complaint in capsys.readouterr().err
    assert not segment.with_name("drive").exists()

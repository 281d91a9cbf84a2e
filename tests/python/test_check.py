# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""topoloc-localise --check names what is wrong, where, and what to do about it."""

import json
import os
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from programs import run

ROOT = Path(__file__).resolve().parents[2]
BIN = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin"))
VEHICLE = """\
format: 1
can:
  dbc: topoloc_imu_wheel.dbc
  imu:
    acceleration: [IMU_ACCEL.ACCEL_X, IMU_ACCEL.ACCEL_Y, IMU_ACCEL.ACCEL_Z]
    angular_rate: [IMU_RATE.RATE_X, IMU_RATE.RATE_Y, IMU_RATE.RATE_Z]
  wheels: {speeds: [WHEEL_SPEEDS.REAR_LEFT, WHEEL_SPEEDS.REAR_RIGHT]}
imu: {calibration: imu.yaml}
live:
  can: {interfaces: [no0]}
  lcm: {url: "udpm://239.255.76.67:7667?ttl=0"}
"""
IMU = """\
accelerometer_noise_density: 0.01
accelerometer_random_walk: 0.0002
gyroscope_noise_density: 0.005
gyroscope_random_walk: 4.0e-06
update_rate: 100.0
"""
CAMERA = """\
cam0:
  camera_model: pinhole
  intrinsics: [500, 500, 320, 192]
  distortion_model: none
  resolution: [640, 384]
  T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]
"""


@pytest.fixture
def vehicle(tmp_path: Path) -> Path:
    shutil.copy(ROOT / "config/topoloc_imu_wheel.dbc", tmp_path)
    (tmp_path / "imu.yaml").write_text(IMU)
    (tmp_path / "camchain.yaml").write_text(CAMERA)
    file = tmp_path / "vehicle.yaml"
    file.write_text(VEHICLE)
    return file


def checks(vehicle: Path, *options: str) -> dict[str, dict[str, Any]]:
    """What --check says, by the thing that it looked at."""
    options = options or ("--dead-reckoning",)
    result = run(BIN / "topoloc-localise", "--config", vehicle, "--check", "--json", "-", *options)
    found = {check["what"]: check for check in json.loads(result.stdout)}
    errors = [c for c in found.values() if c["verdict"] == "error"]
    assert result.returncode == (1 if errors else 0)
    return found


def test_an_unknown_key_is_named_with_its_line(vehicle: Path) -> None:
    vehicle.write_text(VEHICLE + "  rate: 100\n")
    result = run(BIN / "topoloc-localise", "--config", vehicle, "--check", "--dead-reckoning")
    assert result.returncode == 1
    assert re.search(r"vehicle\.yaml:12: live\.rate: ", result.stderr)


def test_a_missing_signal_is_named(vehicle: Path) -> None:
    vehicle.write_text(VEHICLE.replace("ACCEL_Z", "ACCEL_W"))
    signals = checks(vehicle)["CAN signals"]
    assert signals["verdict"] == "error"
    assert "IMU_ACCEL.ACCEL_W" in signals["text"]
    assert "topoloc_imu_wheel.dbc" in signals["text"]


def test_a_missing_interface_is_an_error_that_says_what_to_do(vehicle: Path) -> None:
    interfaces = checks(vehicle)["CAN interfaces"]
    assert interfaces["verdict"] == "error"
    assert "no0" in interfaces["text"]
    assert re.search(r"ip link|modprobe", interfaces["text"])


def test_small_buffers_are_told(vehicle: Path) -> None:
    assert "recv_buf_size" in checks(vehicle)["LCM"]["text"]
    huge = 2_000_000_000
    vehicle.write_text(VEHICLE.replace("ttl=0", f"ttl=0&recv_buf_size={huge}"))
    lcm = checks(vehicle)["LCM"]
    assert lcm["verdict"] == "warning"
    assert f"net.core.rmem_max={huge}" in lcm["text"]


def test_a_map_that_is_none_is_an_error(vehicle: Path) -> None:
    vehicle.write_text(VEHICLE + "camera: {calibration: camchain.yaml}\n")
    not_a_map = vehicle.with_name("town.tmap")
    not_a_map.write_text("nothing")
    found = checks(vehicle, "--map", str(not_a_map))["map and models"]
    assert found["verdict"] == "error"
    assert "town.tmap" in found["text"]


def test_a_map_needs_a_camera(vehicle: Path) -> None:
    found = checks(vehicle, "--map", str(vehicle))["map and models"]
    assert found["verdict"] == "error"
    assert "camera" in found["text"]


@pytest.mark.skipif(os.geteuid() != 0, reason="becomes another user to lose privileges")
def test_missing_privileges_are_told(vehicle: Path) -> None:
    for folder in (vehicle.parent, *vehicle.parent.parents):
        if folder.owner() == "root" and folder.is_relative_to("/tmp"):
            folder.chmod(0o755)
    unprivileged = "setpriv --reuid=65534 --regid=65534 --clear-groups --bounding-set=-all"
    limits = "prlimit --rtprio=0 --memlock=65536"
    result = run(
        *unprivileged.split(),
        *limits.split(),
        *(BIN / "topoloc-localise", "--config", vehicle, "--check", "--dead-reckoning"),
    )
    real_time = next(line for line in result.stdout.splitlines() if "real time" in line)
    assert real_time.startswith("warning")
    assert "rtprio" in real_time.lower() or "CAP_SYS_NICE" in real_time
    assert "memlock" in real_time.lower() or "CAP_IPC_LOCK" in real_time


def test_what_cannot_be_written_is_told(vehicle: Path) -> None:
    vehicle.write_text(VEHICLE + "  journal: {folder: /proc/flight}\n")
    journal = checks(vehicle)["journal"]
    assert journal["verdict"] == "error"
    assert "live.journal.folder" in journal["text"]


def test_too_little_room_for_the_journal_is_a_warning(vehicle: Path, tmp_path: Path) -> None:
    journal = f"  journal: {{folder: {tmp_path / 'flight'}, max_mb: 1048576}}\n"
    vehicle.write_text(VEHICLE + journal)
    check = checks(vehicle)["journal"]
    assert check["verdict"] == "warning"
    assert "live.journal.max_mb" in check["text"]


def test_a_damaged_last_pose_is_a_warning(vehicle: Path, tmp_path: Path) -> None:
    (tmp_path / "last.tum").write_text("1.0 2.0\n")
    vehicle.write_text(VEHICLE + f"  last_pose: {tmp_path / 'last.tum'}\n")
    check = checks(vehicle)["last pose"]
    assert check["verdict"] == "warning"
    assert "last.tum:1" in check["text"]


def test_can_buffers_and_interfaces_that_are_down_are_told(vehicle: Path) -> None:
    huge = 268_435_456
    vehicle.write_text(
        VEHICLE.replace("[no0]}", f"[no0], buffer_bytes: {huge}}}").replace("no0", "vcan0")
    )
    check = f"{BIN / 'topoloc-localise'} --config {vehicle} --check --dead-reckoning"
    limited = f"setpriv --bounding-set=-net_admin --inh-caps=-net_admin {check}"
    script = f"{limited}; ip link set vcan0 down; {check}"
    result = run(ROOT / "tools/with-vcan", "--", "sh", "-c", script)
    if result.returncode == 125:
        pytest.skip(result.stderr)
    lines = [line for line in result.stdout.splitlines() if "vcan0" in line and "warning" in line]
    small, down = (line for line in lines if line.startswith("warning"))
    assert f"net.core.rmem_max={huge}" in small
    assert "ip link set vcan0 up" in down


def test_a_stop_while_the_disk_hangs_is_no_reason_to_restart() -> None:
    codes = run(BIN / "topoloc-localise", "--help").stdout
    assert re.search(r"3 stopped while the\s+disk did not answer", codes)
    unit = (ROOT / "deploy/topoloc-localise.service.in").read_text().splitlines()
    assert "RestartPreventExitStatus=3" in unit

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Importers: a drive folder holds what the source holds."""

from __future__ import annotations

import csv
import os
import re
import struct
from pathlib import Path

import cantools
import lcm
import numpy as np
import pytest
from cantools.database.can import Database
from PIL import Image

from topoloc_import.cli import main
from topoloc_import.drive_folder import DBC
from topoloc_import.lcm_log import PIXEL_FORMAT_GRAY, PIXEL_FORMAT_MJPEG
from topoloc_import.trajectory import quaternions, rotations

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("TOPOLOC_DATA", ROOT.parent / "shared" / "data"))
CALIBRATION = {
    "calib_cam_to_cam.txt": "K_00: 50 0 32 0 50 16 0 0 1\nD_00: -0.3 0.2 0.001 0.002 0\n"
    "R_rect_00: 1 0 0 0 1 0 0 0 1\nP_rect_00: 50 0 32 0 0 50 16 0 0 0 1 0\n",
    "calib_imu_to_velo.txt": "R: 1 0 0 0 1 0 0 0 1\nT: -0.8 0.3 -0.8\n",
    "calib_velo_to_cam.txt": "R: 0 -1 0 0 0 -1 1 0 0\nT: 0 -0.1 -0.3\n",
}
IMAGES = (0, 1, 3)  # the numbering has a gap
ROWS = 10
SPEED_MPS = -1.5  # backwards


def stamp(tenths: int) -> str:
    """A time in KITTI's notation, so many tenths of a second after the start."""
    return f"2011-09-26 13:08:{24 + tenths // 10:02d}.{tenths % 10}00000500"


START_NS = 1317042504 * 10**9 + 500


@pytest.fixture
def raw_drive(tmp_path: Path) -> Path:
    """A KITTI raw drive of ten GNSS/INS rows, three images and two scans."""
    day = tmp_path / "2011_09_26"
    drive = day / "2011_09_26_drive_0001_sync"
    for name in ("image_00", "oxts", "velodyne_points"):
        (drive / name / "data").mkdir(parents=True)
        lines = [stamp(i) if i != 2 or name != "image_00" else "" for i in range(ROWS)]
        (drive / name / "timestamps.txt").write_text("\n".join(lines) + "\n")
    for name, text in CALIBRATION.items():
        (day / name).write_text(text)
    for n in IMAGES:
        pixels = np.full((32, 64), 10 * n, dtype=np.uint8)
        Image.fromarray(pixels).save(drive / "image_00" / "data" / f"{n:010d}.png")
    for n in range(ROWS):
        row: list[float] = [0.0] * 30
        row[0:3] = [49.0 + 1e-6 * n, 8.4, 100.0]
        row[8] = SPEED_MPS
        row[11:14] = [0.1 * n, -0.2, 9.81]
        row[17:20] = [0.01, -0.02, 0.03 * n]
        text = " ".join(str(v) for v in row)
        (drive / "oxts" / "data" / f"{n:010d}.txt").write_text(text + "\n")
    for n in (0, 4):
        # Ahead, on the car, beyond the range.
        points = np.array([[20, 0, 1, 0.5], [0, 0, 0, 0.1], [100, 0, 0, 0.2]], dtype="<f4")
        (drive / "velodyne_points" / "data" / f"{n:010d}.bin").write_bytes(points.tobytes())
    return drive


def decoded_log(path: Path) -> dict[str, list[tuple[int, dict[str, float]]]]:
    """(microseconds, signals) of each message, decoded by cantools."""
    database = cantools.database.load_file(path.with_name(DBC.name), strict=True)
    assert isinstance(database, Database)
    frames: dict[str, list[tuple[int, dict[str, float]]]] = {}
    for line in path.read_text().splitlines():
        match = re.fullmatch(r"\((\d+)\.(\d{6})\) can0 ([0-9A-F]{3})#([0-9A-F]+)", line)
        assert match, line
        message = database.get_message_by_frame_id(int(match[3], 16))
        signals = message.decode(bytes.fromhex(match[4]), decode_choices=False)
        assert isinstance(signals, dict)
        frames.setdefault(message.name, []).append(
            (int(match[1] + match[2]), {k: float(v) for k, v in signals.items()})  # type: ignore[arg-type]
        )
    return frames


def logged_images(path: Path) -> list[tuple[int, tuple[int, ...], bytes]]:
    """(time, (width, height, stride, format), data) of each image_t, read by LCM's own log."""
    images: list[tuple[int, tuple[int, ...], bytes]] = []
    for event in lcm.EventLog(str(path)):
        time_us, width, height, stride, pixel_format, size = struct.unpack_from(
            ">qiiiii", event.data, 8
        )
        assert event.channel == "CAMERA"
        assert event.timestamp == time_us
        assert len(event.data) == 36 + size + 4
        images.append((time_us, (width, height, stride, pixel_format), event.data[36 : 36 + size]))
    return images


def test_raw_drive_keeps_sensor_values(raw_drive: Path, tmp_path: Path) -> None:
    assert main(["kitti-raw", str(raw_drive), "--out", str(tmp_path / "out")]) == 0
    frames = decoded_log(tmp_path / "out" / "can.log")
    assert {name: len(rows) for name, rows in frames.items()} == dict.fromkeys(
        ("IMU_ACCEL", "IMU_RATE", "TRAVEL_DIRECTION", "WHEEL_SPEEDS"), ROWS
    )
    for n, (time_us, signals) in enumerate(frames["IMU_ACCEL"]):
        assert abs(time_us * 1000 - (START_NS + n * 10**8)) <= 500
        assert signals["ACCEL_X"] == pytest.approx(0.1 * n, abs=1.01e-4)
        assert signals["ACCEL_COUNTER"] == n
        # Rates lag by 55 ms of the rows' 100 ms; after the last row there is nothing newer.
        rate = 0.03 * min(n + 0.55, ROWS - 1)
        assert frames["IMU_RATE"][n][1]["RATE_Z"] == pytest.approx(rate, abs=1.01e-5)
        assert frames["WHEEL_SPEEDS"][n][1]["REAR_LEFT"] == pytest.approx(1.5, abs=1.01e-3)
        assert frames["TRAVEL_DIRECTION"][n][1]["DIRECTION"] == 2


def test_raw_drive_goes_by_file_number(raw_drive: Path, tmp_path: Path) -> None:
    assert main(["kitti-raw", str(raw_drive.parent), "--out", str(tmp_path / "out")]) == 0
    images = logged_images(tmp_path / "out" / "camera.lcm")
    assert [(t - START_NS // 1000) // 100_000 for t, _, _ in images] == list(IMAGES)
    assert all(layout == (64, 32, 64, PIXEL_FORMAT_GRAY) for _, layout, _ in images)
    assert [data[0] for _, _, data in images] == [10 * n for n in IMAGES]


def test_raw_drive_cloud_is_placed_by_the_pose(raw_drive: Path, tmp_path: Path) -> None:
    assert main(["kitti-raw", str(raw_drive), "--out", str(tmp_path / "out"), "--cloud"]) == 0
    header, _, body = (tmp_path / "out" / "cloud.ply").read_bytes().partition(b"end_header\n")
    assert b"element vertex 2\n" in header  # neither car nor far point
    points = np.frombuffer(body, dtype="<f4").reshape(-1, 4)
    # Level, heading east: world = scanner + lever arm + way gone north by 1e-6 degrees a row.
    north = np.radians(1e-6) * 6378137.0
    expected = np.array([[20.8, -0.3, 1.8, 0.5], [20.8, -0.3 + 4 * north, 1.8, 0.5]])
    assert points == pytest.approx(expected, abs=1e-4)


def test_raw_drive_rows_out_of_order_are_left_out(
    raw_drive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tenths = [0, 1, 2, 2, 4, 9, 6, 7, 8, 9]  # one twice, one far ahead
    times = raw_drive / "oxts" / "timestamps.txt"
    times.write_text("\n".join(stamp(t) for t in tenths) + "\n")
    assert main(["kitti-raw", str(raw_drive), "--out", str(tmp_path / "out")]) == 0
    assert "oxts: 2 of 10 left out" in capsys.readouterr().out
    rows = decoded_log(tmp_path / "out" / "can.log")["IMU_ACCEL"]
    told = [(time_us * 1000 - START_NS + 500) // 10**8 for time_us, _ in rows]
    assert told == [0, 1, 2, 4, 6, 7, 8, 9]
    assert rows[-1][1]["ACCEL_X"] == pytest.approx(0.9, abs=1.01e-4)


@pytest.mark.parametrize("asked", [[], ["--camera", "02"]])
def test_raw_drive_takes_a_colour_camera_where_there_is_no_grey_one(
    raw_drive: Path, tmp_path: Path, asked: list[str]
) -> None:
    source = raw_drive / "image_00"
    source.rename(raw_drive / "image_02")
    data = raw_drive / "image_02" / "data"
    for png in list(data.iterdir()):
        Image.open(png).convert("RGB").save(png.with_suffix(".jpg"))
        png.unlink()
    calibration = raw_drive.parent / "calib_cam_to_cam.txt"
    more = "P_rect_02: 60 0 31 6 0 60 17 0.6 0 0 1 0.02\nS_rect_02: 64 32\n"
    calibration.write_text(calibration.read_text() + more)
    out = tmp_path / "out"
    assert main(["kitti-raw", str(raw_drive), "--out", str(out), *asked]) == 0
    assert [i[1][:2] for i in logged_images(out / "camera.lcm")] == [(64, 32)] * len(IMAGES)
    camchain = (out / "camchain.yaml").read_text()
    assert "intrinsics: [60.0, 60.0, 31.0, 17.0]" in camchain
    rows = re.findall(r"  - \[(.*)\]", camchain)
    T_cam_imu = np.array([[float(v) for v in row.split(",")] for row in rows])
    # Camera 00's, and what P_rect_02 adds: K [0.0897 0.0043 0.02] = [6 0.6 0.02].
    shift = np.linalg.solve([[60, 0, 31], [0, 60, 17], [0, 0, 1]], [6, 0.6, 0.02])
    turned = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]]) @ [-0.8, 0.3, -0.8] + [0, -0.1, -0.3]
    assert T_cam_imu[:3, 3] == pytest.approx(turned + shift, abs=1e-9)


def test_raw_drive_tells_images_that_are_not_rectified(
    raw_drive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    calibration = raw_drive.parent / "calib_cam_to_cam.txt"
    calibration.write_text(calibration.read_text() + "S_rect_00: 60 30\n")
    assert main(["kitti-raw", str(raw_drive), "--out", str(tmp_path / "out")]) == 1
    assert "64x32 pixels, and rectified ones have 60x30" in capsys.readouterr().err


def test_same_source_gives_same_bytes(raw_drive: Path, tmp_path: Path) -> None:
    for name in ("one", "two"):
        assert main(["kitti-raw", str(raw_drive), "--out", str(tmp_path / name), "--cloud"]) == 0
    files = sorted(p.name for p in (tmp_path / "one").iterdir())
    assert len(files) == 8
    for name in files:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_existing_folder_is_replaced_only_with_force(
    raw_drive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["kitti-raw", str(raw_drive), "--out", str(tmp_path / "out")]
    assert main(command) == 0
    assert main(command) == 1
    assert "--force" in capsys.readouterr().err
    assert main([*command, "--force"]) == 0
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "precious").write_text("")
    assert main(["kitti-raw", str(raw_drive), "--out", str(tmp_path / "other"), "--force"]) == 1
    assert (tmp_path / "other" / "precious").exists()


@pytest.mark.parametrize(
    ("file", "content", "complaint"),
    [
        ("oxts/data/0000000003.txt", "1 2 nan", "expected 30 finite numbers"),
        ("oxts/data/0000000003.txt", "1 2 x", "could not convert"),
        ("image_00/data/0000000001.png", "no image", "cannot identify"),
        ("image_00/data/0000000002.png", "", "no time in line 3"),
        ("image_00/timestamps.txt", "yesterday\n", "timestamps.txt:1: not a time"),
        ("oxts/timestamps.txt", "\n".join([stamp(1)] * ROWS), "do not increase"),
        ("velodyne_points/data/0000000000.bin", "abcdef", "expected finite float32"),
        ("../calib_velo_to_cam.txt", "R: 1 0 0 0 1 0 0 0 2\nT: 0 0 0", "not a rotation"),
        ("../calib_velo_to_cam.txt", "T: 0 0 0", "no R"),
    ],
)
def test_bad_source_leaves_nothing_behind(
    raw_drive: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    file: str,
    content: str,
    complaint: str,
) -> None:
    (raw_drive / file).write_text(content)
    out = tmp_path / "drives" / "out"
    assert main(["kitti-raw", str(raw_drive), "--out", str(out), "--cloud"]) == 1
    assert complaint in capsys.readouterr().err
    assert list(out.parent.iterdir()) == []


def test_quaternions_and_rotations_are_inverse() -> None:
    random = np.random.default_rng(1)
    q = random.normal(size=(200, 4))
    q[:3] = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 1e-9],
        [0.0, 0.0, 0.0, 1.0],
    ]  # half turns and none
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    back = quaternions(rotations(q))
    assert np.abs(np.sum(q * back, axis=1)) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.skipif(not (DATA / "kitti_0039").is_dir(), reason=f"no {DATA}/kitti_0039")
def test_kitti_0039_agrees_with_its_source(tmp_path: Path) -> None:
    source, out = DATA / "kitti_0039", tmp_path / "out"
    assert main(["kitti-0039", str(source), "--out", str(out)]) == 0
    frames = decoded_log(out / "can.log")
    with (source / "imu.csv").open() as file:
        imu = list(csv.DictReader(file))
    with (source / "speed.csv").open() as file:
        speed = list(csv.DictReader(file))
    assert len(frames["IMU_ACCEL"]) == len(imu) == 1002
    # The rates of a row describe the vehicle 55 ms before it: they belong to earlier rows.
    times_s = np.array([(int(r["timestamp_ns"]) - int(imu[0]["timestamp_ns"])) * 1e-9 for r in imu])
    rates = {
        axis: np.interp(times_s + 0.055, times_s, [float(r[f"w{axis}_radps"]) for r in imu])
        for axis in "xyz"
    }
    for i, row in enumerate(imu):
        time_us, accel = frames["IMU_ACCEL"][i]
        assert abs(time_us * 1000 - int(row["timestamp_ns"])) <= 500
        rate = frames["IMU_RATE"][i][1]
        for axis in "xyz":
            name = axis.upper()
            assert abs(accel[f"ACCEL_{name}"] - float(row[f"a{axis}_mps2"])) < 1.01e-4
            assert abs(rate[f"RATE_{name}"] - rates[axis][i]) < 1.01e-5
        wheel = frames["WHEEL_SPEEDS"][i][1]["FRONT_LEFT"]
        assert abs(wheel - float(speed[i]["vf_mps"])) < 1.01e-3
    images = logged_images(out / "camera.lcm")
    assert len(images) == 400
    assert images[0][1] == (1392, 512, 1392, PIXEL_FORMAT_MJPEG)
    assert images[7][2] == (source / "image_00" / "000007.jpg").read_bytes()

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The Complex Urban Dataset importer, on a small recording of that layout that is written here from
a known drive: a car on an inclined arc, its sensors mounted at known angles."""

from __future__ import annotations

import json
import os
import re
import struct
import subprocess
from pathlib import Path

import cantools
import lcm
import numpy as np
import numpy.typing as npt
import pytest
import yaml
from cantools.database.can import Database
from PIL import Image

from topoloc_import.cli import main
from topoloc_import.complex_urban_files import read_camera
from topoloc_import.drive_folder import DBC
from topoloc_import.images import grey_of_mosaic
from topoloc_import.lcm_log import PIXEL_FORMAT_GRAY
from topoloc_import.trajectory import PoseInterpolator, Trajectory, rotations
from topoloc_import.voxel_cloud import VoxelCloud

Array = npt.NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[2]
LOCALISE = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin")) / "topoloc-localise"
START_NS = 1_524_211_208_404_312_059
STEP_NS = 10_000_000
ROWS = 200  # two seconds of poses, IMU rows, counts
SPEED_MPS = 6.0
FIRST_YAW_RAD, TURN_RADPS = 1.0, 0.3
PITCH_RAD, ROLL_RAD = -0.03, -0.02  # nose up: the car climbs where it points
GRAVITY_MPS2 = np.array([0.0, 0.0, 9.81])
TRACK_M = 1.5
FIRST_UTM_M = np.array([333012.345, 4140620.71, 20.46])
ORIGIN_M = np.array([333012.0, 4140621.0, 20.0])
COUNTS_PER_TURN = 1_000_000  # fine, so that counting adds no error worth mention
LEFT_M, RIGHT_M = 0.62, 0.63
WIDTH, HEIGHT = 160, 120
K = np.array([[110.0, 0.2, 78.3], [0.0, 108.0, 61.2], [0.0, 0.0, 1.0]])
RADTAN = [-0.056, 0.14, -0.0012, -0.00097, -0.08]
IMAGE_NS = [START_NS + 333_000_123, START_NS + 1_440_000_456]
SCAN_NS = [START_NS + 402_000_001, START_NS + 1_503_000_002]
# In the world's axes, in front of the car in both images; in the middles of 10 cm voxels.
LANDMARKS_M = np.array([[9.05, 18.05, 2.75], [3.25, 20.15, 4.05], [11.35, 22.75, 0.85]])
INTENSITIES = [11.0, 22.0, 33.0]


def rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    (sr, sp, sy), (cr, cp, cy) = np.sin([roll, pitch, yaw]), np.cos([roll, pitch, yaw])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    R: Array = Rz @ Ry @ Rx
    return R


def transform(R: Array, t: tuple[float, float, float] | Array) -> Array:
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = R, t
    return result


FORWARD_CAMERA = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
MOUNTINGS = {  # T_vehicle_sensor
    "IMU": transform(rpy(0.1, -0.2, 0.3), (-0.07, 0.1, 1.7)),
    "Stereo": transform(FORWARD_CAMERA @ rpy(0.01, -0.02, 0.03), (1.64, 0.25, 1.58)),
    "LeftVLP": transform(rpy(0.03, 0.78, 2.38), (-0.44, 0.4, 1.91)),
    "RightVLP": transform(rpy(-0.02, 0.79, -2.4), (-0.45, -0.42, 1.9)),
    "BackSick": transform(rpy(2.2, 0.0, -1.57), (-0.9, 0.0, 1.6)),
    "MiddleSick": transform(rpy(2.49, 0.001, 1.57), (0.83, -0.01, 1.76)),
}


def vehicle_pose(time_ns: int) -> Array:
    """T_world_vehicle [m], ORIGIN_M taken off."""
    t = (time_ns - START_NS) * 1e-9
    first, yaw = FIRST_YAW_RAD, FIRST_YAW_RAD + TURN_RADPS * t
    radius = SPEED_MPS * np.cos(PITCH_RAD) / TURN_RADPS
    east = radius * (np.sin(yaw) - np.sin(first))
    north = radius * (np.cos(first) - np.cos(yaw))
    up = -np.sin(PITCH_RAD) * SPEED_MPS * t
    return transform(rpy(ROLL_RAD, PITCH_RAD, yaw), FIRST_UTM_M - ORIGIN_M + [east, north, up])


def apply(T: Array, points: Array) -> Array:
    moved: Array = points @ T[:3, :3].T + T[:3, 3]
    return moved


def project(K: Array, radtan: list[float], p_cam: Array) -> Array:
    """Pixels (n, 2), written out apart from the importer."""
    x, y = p_cam[:, 0] / p_cam[:, 2], p_cam[:, 1] / p_cam[:, 2]
    k1, k2, p1, p2, k3 = radtan
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([K[0, 0] * xd + K[0, 1] * yd + K[0, 2], K[1, 1] * yd + K[1, 2]], axis=1)


def seen_from(sensor: str, time_ns: int, p_world: Array) -> Array:
    return apply(np.linalg.inv(vehicle_pose(time_ns) @ MOUNTINGS[sensor]), p_world)


def imu_sample(i: int) -> tuple[list[float], list[float]]:
    """Specific force and rate of row i in the axes of the IMU, which the turn swings around."""
    pose = vehicle_pose(START_NS + 5_000_000 + i * STEP_NS)
    R_imu_world = (pose[:3, :3] @ MOUNTINGS["IMU"][:3, :3]).T
    arm = pose[:3, :3] @ MOUNTINGS["IMU"][:3, 3]
    turn = np.array([0.0, 0.0, TURN_RADPS])
    acceleration = np.cross(turn, SPEED_MPS * pose[:3, 0] + np.cross(turn, arm))
    force = R_imu_world @ (acceleration + GRAVITY_MPS2)
    return force.tolist(), (R_imu_world @ turn).tolist()


def imu_row(i: int) -> list[float]:
    """Attitude, rate, specific force, magnetic field; what must not matter is no attitude."""
    force, rate = imu_sample(i)
    return [77.0] * 7 + rate + force + [88.0] * 3


def mosaic(time_ns: int) -> npt.NDArray[np.uint8]:
    """A raw image: flat colour red 40, green 20, blue 10 in RGGB order, and white landmarks."""
    image = np.empty((HEIGHT, WIDTH))
    image[0::2, 0::2], image[0::2, 1::2], image[1::2, 0::2], image[1::2, 1::2] = 40, 20, 20, 10
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    for u, v in project(K, RADTAN, seen_from("Stereo", time_ns, LANDMARKS_M)):
        image += 200 * np.exp(-((columns - u) ** 2 + (rows - v) ** 2) / (2 * 1.5**2))
    return np.rint(image).astype(np.uint8)


def write_scan(folder: Path, time_ns: int, points: Array, intensities: list[float]) -> None:
    values = np.hstack([points, np.reshape(intensities, (-1, 1))]).astype("<f4")
    (folder / f"{time_ns}.bin").write_bytes(values.tobytes())


def csv_lines(offset_ns: int, values: list[list[float]]) -> str:
    rows = (
        ",".join([str(START_NS + offset_ns + i * STEP_NS), *(f"{v:.9g}" for v in row)])
        for i, row in enumerate(values)
    )
    return "\n".join(rows) + "\n"


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A folder of the public layout."""
    source = tmp_path / "urban99"
    lidars = ("VLP_left", "VLP_right", "SICK_middle")
    for name in ("calibration", "image/stereo_left", *(f"sensor_data/{lidar}" for lidar in lidars)):
        (source / name).mkdir(parents=True)
    for sensor, T in MOUNTINGS.items():
        (source / "calibration" / f"Vehicle2{sensor}.txt").write_text(
            f"{sensor} extrinsic calibration parameter from vehicle\n"
            "RPY(roll/pitch/yaw = XYZ extrinsic, degree), R(rotation matrix), T(translation)\n"
            "RPY: 1 2 3\n"
            f"R: {' '.join(f'{v:.7f}' for v in T[:3, :3].ravel())} \n"
            f"T: {' '.join(f'{v:.6g}' for v in T[:3, 3])}\n"
        )
    (source / "calibration" / "EncoderParameter.txt").write_text(
        f"Encoder calibrated parameter\nEncoder resolution: {COUNTS_PER_TURN}\n"
        f"Encoder left wheel diameter: {LEFT_M}\nEncoder right wheel diameter: {RIGHT_M}\n"
        f"Encoder wheel base: {TRACK_M}\n"
    )
    (source / "calibration" / "left.yaml").write_text(
        f"image_width: {WIDTH}\nimage_height: {HEIGHT}\ncamera_name: stereo/left\n"
        f"camera_matrix:\n  rows: 3\n  cols: 3\n  data: {K.ravel().tolist()}\n"
        "distortion_model: plumb_bob\n"
        f"distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: {RADTAN}\n"
    )
    poses = [vehicle_pose(START_NS + i * STEP_NS) for i in range(ROWS)]
    for pose in poses:
        pose[:3, 3] += ORIGIN_M
    lines = (
        ",".join([str(START_NS + i * STEP_NS), *(f"{v:.10g}" for v in pose[:3].ravel())])
        for i, pose in enumerate(poses)
    )
    (source / "global_pose.csv").write_text("\n".join(lines) + "\n")
    sensors = source / "sensor_data"
    rows = [imu_row(i) for i in range(ROWS)]
    (sensors / "xsens_imu.csv").write_text(csv_lines(5_000_000, rows))
    (sensors / "encoder.csv").write_text(csv_lines(3_000_000, encoder_counts(ROWS)))
    for time_ns in IMAGE_NS:
        Image.fromarray(mosaic(time_ns)).save(source / "image" / "stereo_left" / f"{time_ns}.png")
    # Each scan: the landmarks, then a point on the car, a far one, a lost one and a NaN.
    for lidar, sensor in (("VLP_left", "LeftVLP"), ("VLP_right", "RightVLP")):
        for time_ns in SCAN_NS:
            car = apply(np.linalg.inv(MOUNTINGS[sensor]), np.array([[1.0, 0.2, 0.9]]))
            others = np.array([[100.0, 0, 0], [0, 0, 0], [np.nan, 0, 0]])
            points = np.vstack([seen_from(sensor, time_ns, LANDMARKS_M), car, others])
            write_scan(sensors / lidar, time_ns, points, INTENSITIES + [99.0] * 4)
    beams = np.zeros((286, 2), dtype="<f4")
    beams[100] = [12.0, 55.0]
    (sensors / "SICK_middle" / f"{SCAN_NS[0]}.bin").write_bytes(beams.tobytes())
    return source


def encoder_counts(rows: int, speed_mps: float = SPEED_MPS) -> list[list[float]]:
    """Running counts of the left and right wheel on the arc."""
    seconds = np.arange(rows) * STEP_NS * 1e-9
    left = (speed_mps - TURN_RADPS * TRACK_M / 2) * seconds / (np.pi * LEFT_M)
    right = (speed_mps + TURN_RADPS * TRACK_M / 2) * seconds / (np.pi * RIGHT_M)
    counts = np.stack([left, right], axis=1) * COUNTS_PER_TURN + [123456789, 5]
    return [[float(v) for v in row] for row in np.rint(counts)]


def run(source: Path, *more: str) -> int:
    return main(["complex-urban", str(source), "--out", str(source.with_name("drive")), *more])


def decoded_log(drive: Path) -> dict[str, list[tuple[int, dict[str, float]]]]:
    """(microseconds, signals) of each message in the order of the log, decoded by cantools."""
    database = cantools.database.load_file(drive / DBC.name, strict=True)
    assert isinstance(database, Database)
    frames: dict[str, list[tuple[int, dict[str, float]]]] = {}
    last_us = 0
    for line in (drive / "can.log").read_text().splitlines():
        match = re.fullmatch(r"\((\d+)\.(\d{6})\) can0 ([0-9A-F]{3})#([0-9A-F]+)", line)
        assert match, line
        time_us = int(match[1] + match[2])
        assert time_us >= last_us
        last_us = time_us
        message = database.get_message_by_frame_id(int(match[3], 16))
        signals = message.decode(bytes.fromhex(match[4]), decode_choices=False)
        assert isinstance(signals, dict)
        frames.setdefault(message.name, []).append(
            (time_us, {k: float(v) for k, v in signals.items()})  # type: ignore[arg-type]
        )
    return frames


def logged_images(path: Path) -> list[tuple[int, Array]]:
    """(microseconds, grey image) of each frame, read by LCM's own log."""
    images: list[tuple[int, Array]] = []
    for event in lcm.EventLog(str(path)):
        time_us, width, height, stride, pixel_format, size = struct.unpack_from(
            ">qiiiii", event.data, 8
        )
        assert (width, height, stride, pixel_format) == (WIDTH, HEIGHT, WIDTH, PIXEL_FORMAT_GRAY)
        assert event.channel == "CAMERA" and event.timestamp == time_us
        data = np.frombuffer(event.data[36 : 36 + size], dtype=np.uint8)
        images.append((time_us, data.reshape(height, width).astype(np.float64)))
    return images


def cloud_points(drive: Path) -> Array:
    """(n, 4) x y z intensity."""
    header, _, body = (drive / "cloud.ply").read_bytes().partition(b"end_header\n")
    points = np.frombuffer(body, dtype="<f4").reshape(-1, 4)
    assert f"element vertex {len(points)}\n".encode() in header
    return points.astype(np.float64)


def truth(drive: Path) -> PoseInterpolator:
    """T_world_imu of ground_truth.tum."""
    lines = [line.split() for line in (drive / "ground_truth.tum").read_text().splitlines()[1:]]
    times = [int(words[0].replace(".", "")) for words in lines]
    numbers = np.array([[float(word) for word in words[1:]] for words in lines])
    return PoseInterpolator(
        Trajectory(np.array(times, np.int64), numbers[:, :3], rotations(numbers[:, 3:]))
    )


def test_imu_rows_keep_their_values_and_times(recording: Path) -> None:
    assert run(recording) == 0
    frames = decoded_log(recording.with_name("drive"))
    assert len(frames["IMU_ACCEL"]) == len(frames["IMU_RATE"]) == ROWS
    for i in range(ROWS):
        force, rate = imu_sample(i)
        for name, signal, expected, error in (
            ("IMU_ACCEL", "ACCEL", force, 1.01e-4),
            ("IMU_RATE", "RATE", rate, 1.01e-5),
        ):
            time_us, signals = frames[name][i]
            assert abs(time_us * 1000 - (START_NS + 5_000_000 + i * STEP_NS)) <= 500
            assert [signals[f"{signal}_{a}"] for a in "XYZ"] == pytest.approx(expected, abs=error)
            assert signals[f"{signal}_COUNTER"] == i % 16


@pytest.mark.parametrize(("speed_mps", "direction"), [(SPEED_MPS, 1), (-2.0, 2)])
def test_wheel_speeds_are_count_differences_over_time(
    recording: Path, speed_mps: float, direction: int
) -> None:
    counts = csv_lines(3_000_000, encoder_counts(ROWS, speed_mps))
    (recording / "sensor_data" / "encoder.csv").write_text(counts)
    assert run(recording) == 0
    frames = decoded_log(recording.with_name("drive"))
    assert len(frames["WHEEL_SPEEDS"]) == len(frames["TRAVEL_DIRECTION"]) == ROWS - 1
    for i, (time_us, signals) in enumerate(frames["WHEEL_SPEEDS"]):
        middle_ns = START_NS + 3_000_000 + i * STEP_NS + STEP_NS // 2
        assert abs(time_us * 1000 - middle_ns) <= 500
        for side, sign in (("LEFT", -1), ("RIGHT", 1)):
            expected = abs(speed_mps + sign * TURN_RADPS * TRACK_M / 2)
            assert signals[f"FRONT_{side}"] == signals[f"REAR_{side}"]
            assert signals[f"REAR_{side}"] == pytest.approx(expected, abs=1.5e-3)
        assert frames["TRAVEL_DIRECTION"][i][0] == time_us
        assert frames["TRAVEL_DIRECTION"][i][1]["DIRECTION"] == direction


def test_wheels_that_turn_against_each_other_keep_their_mean(recording: Path) -> None:
    per_metre = COUNTS_PER_TURN / np.pi
    counts = [[-0.01 * i * per_metre / LEFT_M, 0.03 * i * per_metre / RIGHT_M] for i in range(ROWS)]
    rounded = [[float(round(v)) for v in row] for row in counts]
    (recording / "sensor_data" / "encoder.csv").write_text(csv_lines(0, rounded))
    assert run(recording) == 0
    frames = decoded_log(recording.with_name("drive"))
    signals = frames["WHEEL_SPEEDS"][7][1]  # left -1, right +3 m/s
    assert [signals["REAR_LEFT"], signals["REAR_RIGHT"]] == pytest.approx([0.0, 2.0], abs=2e-3)
    assert frames["TRAVEL_DIRECTION"][7][1]["DIRECTION"] == 1


def test_truth_is_the_imus_pose_from_the_stated_origin(recording: Path) -> None:
    assert run(recording) == 0
    drive = recording.with_name("drive")
    assert yaml.safe_load((drive / "world.yaml").read_text())["origin_m"] == ORIGIN_M.tolist()
    times = np.array([START_NS + i * STEP_NS for i in range(ROWS)])
    position, rotation = truth(drive).at(times)
    for i in range(0, ROWS, 7):
        expected = vehicle_pose(int(times[i])) @ MOUNTINGS["IMU"]
        assert position[i] == pytest.approx(expected[:3, 3], abs=1e-3)
        assert rotation[i] == pytest.approx(expected[:3, :3], abs=1e-6)


def test_origin_can_be_given(recording: Path) -> None:
    assert run(recording, "--origin", "333000", "4140000.5", "-3", "--cloud") == 0
    drive = recording.with_name("drive")
    shift = ORIGIN_M - [333000, 4140000.5, -3]
    position, _ = truth(drive).at(np.array([START_NS]))
    expected = vehicle_pose(START_NS) @ MOUNTINGS["IMU"]
    assert position[0] == pytest.approx(expected[:3, 3] + shift, abs=1e-3)
    assert cloud_points(drive)[:3, :3] == pytest.approx(LANDMARKS_M + shift, abs=1e-3)
    assert yaml.safe_load((drive / "world.yaml").read_text())["origin_m"] == [333000, 4140000.5, -3]


def test_vehicle_file_holds_the_mounting_of_the_imu(recording: Path) -> None:
    assert run(recording) == 0
    vehicle = yaml.safe_load((recording.with_name("drive") / "vehicle.yaml").read_text())["vehicle"]
    R_vehicle_imu = rpy(*vehicle["rotation_vehicle_imu_rpy_rad"])
    assert R_vehicle_imu == pytest.approx(MOUNTINGS["IMU"][:3, :3], abs=1e-6)
    # The vehicle's origin, seen from the IMU, goes back to the vehicle's zero.
    reference = np.array([vehicle["wheel_reference_imu_m"]])
    assert apply(MOUNTINGS["IMU"], reference) == pytest.approx(np.zeros((1, 3)), abs=1e-6)


def test_images_keep_times_and_turn_grey(recording: Path) -> None:
    assert run(recording) == 0
    images = logged_images(recording.with_name("drive") / "camera.lcm")
    assert [abs(t * 1000 - e) <= 500 for (t, _), e in zip(images, IMAGE_NS, strict=True)]
    for _, image in images:
        assert image[:20] == pytest.approx(np.full((20, WIDTH), 23.0))  # (40 + 2 * 20 + 10) / 4


def test_grey_images_are_taken_as_they_are(recording: Path) -> None:
    assert run(recording, "--grey") == 0
    for (_, image), time_ns in zip(
        logged_images(recording.with_name("drive") / "camera.lcm"), IMAGE_NS, strict=True
    ):
        assert (image == mosaic(time_ns)).all()


@pytest.mark.parametrize("pattern", ["rggb", "bggr", "grbg", "gbrg"])
def test_grey_of_a_flat_colour_is_flat_in_every_pattern(pattern: str) -> None:
    raw = np.empty((7, 10), dtype=np.uint8)
    for k, colour in enumerate(pattern):
        raw[k // 2 :: 2, k % 2 :: 2] = {"r": 200, "g": 100, "b": 40}[colour]
    assert (grey_of_mosaic(raw) == 110).all()


def test_landmarks_of_scans_land_in_the_world_and_in_the_images(recording: Path) -> None:
    assert run(recording, "--cloud") == 0
    drive = recording.with_name("drive")
    # Two scanners, each two scans from places several metres apart: one point per landmark.
    points = cloud_points(drive)
    assert len(points) == len(LANDMARKS_M)
    assert points[:, :3] == pytest.approx(LANDMARKS_M, abs=2e-3)
    assert points[:, 3].tolist() == INTENSITIES
    # From the cloud to pixels by what the drive folder says, and nothing else.
    camera = yaml.safe_load((drive / "camchain.yaml").read_text())["cam0"]
    fx, fy, cx, cy = camera["intrinsics"]
    assert camera["resolution"] == [WIDTH, HEIGHT]
    poses = truth(drive)
    for time_us, image in logged_images(drive / "camera.lcm"):
        position, rotation = poses.at(np.array([time_us * 1000]))
        T_world_imu = transform(rotation[0], position[0])
        T_cam_world = np.array(camera["T_cam_imu"]) @ np.linalg.inv(T_world_imu)
        pixels = project(
            np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]),
            camera["distortion_coeffs"],
            apply(T_cam_world, points[:, :3]),
        )
        rows, columns = np.mgrid[:HEIGHT, :WIDTH]
        for u, v in pixels:
            assert 8 < u < WIDTH - 8 and 8 < v < HEIGHT - 8  # the test itself makes sense
            window = np.hypot(columns - u, rows - v) < 6
            weight = np.where(window, image - 23.0, 0.0)
            centre = [(weight * c).sum() / weight.sum() for c in (columns, rows)]
            assert weight.max() > 80
            assert centre == pytest.approx([u, v], abs=0.15)  # 0.1 of it is the skew


def test_all_points_without_voxels(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(recording, "--cloud", "--voxel", "0") == 0
    points = cloud_points(recording.with_name("drive"))
    assert points[:, :3] == pytest.approx(np.tile(LANDMARKS_M, (4, 1)), abs=2e-3)
    out = capsys.readouterr().out
    assert "4 points are not finite" in out
    assert "8 points are on the car or lost" in out
    assert "4 points are beyond 80 m" in out


def test_max_range_and_choice_of_scanner(recording: Path) -> None:
    assert (
        run(recording, "--cloud", "--voxel", "0", "--lidars", "VLP_left", "--max-range", "150") == 0
    )
    assert len(cloud_points(recording.with_name("drive"))) == 8  # the far point too


def test_sick_beams_lie_in_the_scanners_plane(recording: Path) -> None:
    assert run(recording, "--cloud", "--lidars", "SICK_middle") == 0
    angle = np.radians(-5 + 100 * 190 / 285)
    p_sick = np.array([[12 * np.cos(angle), 12 * np.sin(angle), 0.0]])
    expected = apply(vehicle_pose(SCAN_NS[0]) @ MOUNTINGS["MiddleSick"], p_sick)
    points = cloud_points(recording.with_name("drive"))
    assert points[:, :3] == pytest.approx(expected, abs=2e-3)
    assert points[0, 3] == 55


def test_deskew_places_each_point_at_its_own_time(recording: Path) -> None:
    """A scanner that turned clockwise and saw points all around one after the other; two of them
    with the same firing, a hair apart."""
    around = np.array([[-15.0, 5.0, 3.0], [10.0, -12.0, 2.0], [20.0, 3.0, 4.0], [9.0, 18.0, 2.7]])
    folder = recording / "sensor_data" / "VLP_left"
    for file in folder.iterdir():
        file.unlink()
    time_ns = SCAN_NS[0]
    last = seen_from("LeftVLP", time_ns, around[3:])
    end = np.arctan2(last[0, 1], last[0, 0])
    points = []
    for landmark in around[:3]:
        age_ns = 0
        for _ in range(20):  # where it was seen depends on when, and when on where
            p = seen_from("LeftVLP", time_ns - age_ns, landmark[None])[0]
            age_ns = round(((np.arctan2(p[1], p[0]) - end) % (2 * np.pi)) / (2 * np.pi) * 1e8)
        points.append(p)
    beside = last @ rpy(0, 0, 1e-5)  # turned clockwise
    write_scan(folder, time_ns, np.vstack([points, beside, last]), [1.0, 2.0, 3.0, 4.0, 5.0])
    command = ["--cloud", "--voxel", "0", "--lidars", "VLP_left"]
    assert run(recording, *command) == 0
    in_order = around[[0, 1, 2, 3, 3]]
    skewed = cloud_points(recording.with_name("drive"))[:, :3]
    assert np.linalg.norm(skewed - in_order, axis=1).max() > 0.3
    assert run(recording, *command, "--deskew", "--force") == 0
    placed = cloud_points(recording.with_name("drive"))[:, :3]
    assert placed == pytest.approx(in_order, abs=2e-3)


def test_scans_without_poses_are_left_out_and_counted(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = recording / "sensor_data" / "VLP_left"
    scan = (folder / f"{SCAN_NS[0]}.bin").read_bytes()
    (folder / f"{START_NS - 1}.bin").write_bytes(scan)
    (folder / f"{START_NS + 10**10}.bin").write_bytes(scan)
    poses = (recording / "global_pose.csv").read_text().splitlines(keepends=True)
    (recording / "global_pose.csv").write_text("".join(poses[:120] + poses[190:]))  # hole: 0.7 s
    assert run(recording, "--cloud", "--voxel", "0") == 0
    assert "scans: 4 of 6 have no poses around them" in capsys.readouterr().out
    points = cloud_points(recording.with_name("drive"))
    assert points[:, :3] == pytest.approx(np.tile(LANDMARKS_M, (2, 1)), abs=2e-3)


def test_dead_reckoning_follows_the_truth(recording: Path, tmp_path: Path) -> None:
    """IMU, wheels, mounting and truth of the folder fit together: the filter agrees with all."""
    assert run(recording) == 0
    estimate, summary = tmp_path / "estimate.tum", tmp_path / "summary.json"
    command: list[str | Path] = [LOCALISE, "--drive", recording.with_name("drive")]
    command += ["--dead-reckoning", "--out", estimate, "--json", summary]
    subprocess.run(command, check=True)
    assert set(json.loads(summary.read_text())["rejected"]) <= {
        "imu_before_start",
        "speed_before_start",
    }
    last = np.loadtxt(estimate)[-1]
    expected = vehicle_pose(round(last[0] * 1e9)) @ MOUNTINGS["IMU"]
    assert last[0] > START_NS * 1e-9 + 1.9
    assert last[1:4] == pytest.approx(expected[:3, 3], abs=0.05)
    # The filter starts with the rotation of the pose 10 ms before its first sample: 3 mrad here.
    assert rotations(last[None, 4:])[0] == pytest.approx(expected[:3, :3], abs=0.005)


@pytest.mark.parametrize("tiles_in_memory", [1, 64])
def test_voxel_cloud_keeps_the_first_point_of_each_voxel(
    tmp_path: Path, tiles_in_memory: int
) -> None:
    random = np.random.default_rng(1)
    batches = [random.uniform(-120, 120, (500, 3)) * [1, 1, 0.05] for _ in range(6)]
    first: dict[tuple[int, ...], Array] = {}
    for point in np.concatenate(batches):
        first.setdefault(tuple(np.floor(point / 7.0).astype(int).tolist()), point)
    path = tmp_path / "cloud.ply"
    with VoxelCloud(path, 7.0, "a test", tiles_in_memory) as cloud:
        for batch in batches:
            cloud.add(batch, np.zeros(len(batch)))
    assert cloud.points == len(first)
    assert cloud_points(tmp_path)[:, :3] == pytest.approx(np.array(list(first.values())), abs=1e-5)
    assert [p.name for p in tmp_path.iterdir()] == ["cloud.ply"]


def test_same_source_gives_same_bytes(recording: Path, tmp_path: Path) -> None:
    for name in ("one", "two"):
        command = ["complex-urban", str(recording), "--out", str(tmp_path / name), "--cloud"]
        assert main(command) == 0
    files = sorted(p.name for p in (tmp_path / "one").iterdir())
    assert files == [
        "camchain.yaml",
        "camera.lcm",
        "can.log",
        "cloud.ply",
        "ground_truth.tum",
        "imu.yaml",
        DBC.name,
        "vehicle.yaml",
        "world.yaml",
    ]
    for name in files:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_a_few_rows_out_of_order_are_left_out_and_counted(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = recording / "sensor_data" / "xsens_imu.csv"
    lines = path.read_text().splitlines(keepends=True)
    lines[50], lines[51] = lines[51], lines[50]
    path.write_text("".join(lines))
    assert run(recording) == 0
    assert "xsens_imu.csv: 1 of 200 rows are not later than all before them (first: line 52)" in (
        capsys.readouterr().out
    )
    assert len(decoded_log(recording.with_name("drive"))["IMU_ACCEL"]) == ROWS - 1


def test_counter_set_back_and_lost_rows_are_left_out_and_counted(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    counts = np.array(encoder_counts(ROWS))
    counts[100:] -= counts[100] - 7
    lines = csv_lines(3_000_000, counts.tolist()).splitlines(keepends=True)
    (recording / "sensor_data" / "encoder.csv").write_text("".join(lines[:20] + lines[80:]))
    assert run(recording) == 0
    out = capsys.readouterr().out
    assert "encoder.csv: 1 intervals are longer than 0.5 s (first: line 21)" in out
    assert "encoder.csv: 1 steps mean more than 65 m/s (first: line 41)" in out
    assert len(decoded_log(recording.with_name("drive"))["WHEEL_SPEEDS"]) == 140 - 1 - 2


def test_opencvs_yaml_is_read_too(tmp_path: Path) -> None:
    path = tmp_path / "left.yaml"
    path.write_text(
        "%YAML:1.0\n---\nimage_width: 1280\nimage_height: 560\n"
        "camera_matrix: !!opencv-matrix\n  rows: 3\n  cols: 3\n  dt: d\n"
        "  data: [ 8.1e+02, 5.0e-01, 6.0e+02, 0., 8.0e+02, 2.6e+02, 0., 0., 1. ]\n"
        "distortion_coefficients: !!opencv-matrix\n  rows: 1\n  cols: 4\n  dt: d\n"
        "  data: [ -5.6e-02, 1.4e-01, -1.2e-03, -9.7e-04 ]\n"
    )
    camera = read_camera(path)
    assert (camera.width_px, camera.height_px) == (1280, 560)
    assert camera.K[0].tolist() == [810, 0.5, 600]
    assert camera.radtan == [-0.056, 0.14, -0.0012, -0.00097]


@pytest.mark.parametrize(
    ("file", "content", "complaint"),
    [
        ("global_pose.csv", None, "global_pose.csv: No such file"),
        (
            "global_pose.csv",
            "line 9: short",
            "global_pose.csv:9: expected 13 columns, found 12",
        ),
        ("global_pose.csv", "line 9: nan", "global_pose.csv:9: not finite"),
        ("global_pose.csv", "line 9: word", "global_pose.csv:9: could not convert"),
        ("global_pose.csv", "line 9: 2.5", "global_pose.csv:9: not a rotation"),
        ("global_pose.csv", "\n", "global_pose.csv: fewer than two rows"),
        ("sensor_data/xsens_imu.csv", None, "xsens_imu.csv: No such file"),
        ("sensor_data/xsens_imu.csv", "1,2,3,4,5,6,7,8\n", "xsens_imu.csv:1: 8 columns"),
        ("sensor_data/xsens_imu.csv", "line 3: short", "xsens_imu.csv:3: expected 17"),
        ("sensor_data/xsens_imu.csv", "line 3: inf", "xsens_imu.csv:3: not finite"),
        ("sensor_data/xsens_imu.csv", "line 1: reverse", "199 of 200 rows are not later"),
        ("sensor_data/xsens_imu.csv", b"\xff\xfe", "xsens_imu.csv: not a text file"),
        ("sensor_data/encoder.csv", "line 200: short", "encoder.csv:200: expected 3 columns"),
        ("sensor_data/encoder.csv", "1,0,0\n9000000000,0,0\n", "encoder.csv: no usable step"),
        ("calibration/EncoderParameter.txt", "Encoder resolution: 0\n", "not positive"),
        ("calibration/EncoderParameter.txt", "Encoder resolution: 9\n", "no Encoder left wheel"),
        ("calibration/Vehicle2IMU.txt", None, "Vehicle2IMU.txt: No such file"),
        ("calibration/Vehicle2IMU.txt", "R: 1 0 0 0 1 0 0 0 2\nT: 0 0 0\n", "2IMU.txt: not a rot"),
        ("calibration/Vehicle2Stereo.txt", "R: 1 0 0 0 1 0 0 0 1\n", "Vehicle2Stereo.txt: no T"),
        ("calibration/Vehicle2LeftVLP.txt", "T: 0 0 0\n", "Vehicle2LeftVLP.txt: no R"),
        ("calibration/left.yaml", "image_width: [\n", "left.yaml: "),
        ("calibration/left.yaml", "image_width: 3\n", "left.yaml: not a camera calibration"),
        ("image/stereo_left/first.png", "", "first.png: the name is not a time"),
        ("image/stereo_left/1.png", "no image", "1.png: cannot identify"),
        ("sensor_data/VLP_left/1524211208900000000.bin", "abc", "3 bytes are no multiple of 4"),
        ("sensor_data/VLP_left/scan.bin", "", "scan.bin: the name is not a time"),
    ],
)
def test_bad_sources_are_named_and_leave_nothing_behind(
    recording: Path,
    capsys: pytest.CaptureFixture[str],
    file: str,
    content: str | bytes | None,
    complaint: str,
) -> None:
    path = recording / file
    # None: no such file. "line N: what": the file with that change of this line.
    if content is None:
        path.unlink()
    elif isinstance(content, bytes):
        path.write_bytes(content)
    elif match := re.fullmatch(r"line (\d+): (\S+)", content):
        lines = path.read_text().splitlines()
        words = lines[int(match[1]) - 1].split(",")
        if match[2] == "reverse":
            lines.reverse()
        elif match[2] == "short":
            lines[int(match[1]) - 1] = ",".join(words[:-1])
        else:
            lines[int(match[1]) - 1] = ",".join([words[0], match[2], *words[2:]])
        path.write_text("\n".join(lines) + "\n")
    else:
        path.write_text(content)
    assert run(recording, "--cloud") == 1
    assert complaint in capsys.readouterr().err
    assert not recording.with_name("drive").exists()
    assert not recording.with_name("drive.partial").exists()


def test_missing_folders_and_wrong_sizes_are_named(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(recording, "--cloud", "--lidars", "SICK_back") == 1
    assert "SICK_back: no such folder" in capsys.readouterr().err
    (recording / "sensor_data" / "SICK_middle" / "1524211208900000000.bin").write_bytes(bytes(16))
    assert run(recording, "--cloud", "--lidars", "SICK_middle") == 1
    assert "expected 286 beams, found 2" in capsys.readouterr().err
    image = recording / "image" / "stereo_left" / f"{IMAGE_NS[1]}.png"
    Image.fromarray(np.zeros((10, 20), dtype=np.uint8)).save(image)
    assert run(recording) == 1
    assert f"{IMAGE_NS[1]}.png: 20x10 px, but left.yaml has 160x120" in capsys.readouterr().err


@pytest.mark.parametrize(
    "more", [["--voxel", "0.1"], ["--cloud", "--voxel", "-1"], ["--origin", "1", "2", "nan"]]
)
def test_wrong_usage(recording: Path, more: list[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        run(recording, *more)
    assert stopped.value.code == 2

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""tools/mirrored_drive.py: the drive is closed, and its sensors agree with its reference."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cantools
import numpy as np
import numpy.typing as npt
import pytest
from cantools.database.can import Database
from scipy.spatial.transform import Rotation

from mirrored_drive import GRAVITY_MPS2, main
from topoloc_import.can_log import COUNTER_MODULO
from topoloc_import.drive_folder import CHANNEL, DBC
from topoloc_import.lcm_log import CameraFrame, read_frames
from topoloc_import.trajectory import PoseInterpolator, Trajectory, read_tum

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("TOPOLOC_DATA", ROOT.parent / "shared" / "data"))
STANDING_ROWS = 50  # at both ends of the log: 2 s

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Mirrored:
    source: Path
    folder: Path
    truth: Trajectory
    force_mps2: Floats
    rate_radps: Floats
    speed_mps: Floats
    counters: npt.NDArray[np.int64]


def decoded(folder: Path) -> dict[str, list[dict[str, float]]]:
    """Signals of all frames of the log, by message."""
    database = cantools.database.load_file(folder / DBC.name)
    assert isinstance(database, Database)
    messages: dict[str, list[dict[str, float]]] = {m.name: [] for m in database.messages}
    for line in (folder / "can.log").read_text().splitlines():
        _, _, frame = line.split()
        frame_id, payload = frame.split("#")
        message = database.get_message_by_frame_id(int(frame_id, 16))
        signals = message.decode(bytes.fromhex(payload), decode_choices=False)
        assert isinstance(signals, dict)
        messages[message.name].append({k: float(str(v)) for k, v in signals.items()})
    return messages


def columns(rows: list[dict[str, float]], *names: str) -> Floats:
    return np.array([[row[name] for name in names] for row in rows])


@pytest.fixture(scope="module")
def mirrored(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Mirrored:
    if not (DATA / "kitti_0039").is_dir():
        pytest.skip(f"skipped: {DATA / 'kitti_0039'} is not there")
    source: Path = request.getfixturevalue("kitti_0039")
    folder = tmp_path_factory.mktemp("mirrored") / "drive"
    assert main(["--drive", str(source), "--out", str(folder)]) == 0
    messages = decoded(folder)
    direction = columns(messages["TRAVEL_DIRECTION"], "DIRECTION")[:, 0]
    sign = np.array([0.0, 1.0, -1.0])[direction.astype(int)]
    return Mirrored(
        source=source,
        folder=folder,
        truth=read_tum(folder / "ground_truth.tum"),
        force_mps2=columns(messages["IMU_ACCEL"], "ACCEL_X", "ACCEL_Y", "ACCEL_Z"),
        rate_radps=columns(messages["IMU_RATE"], "RATE_X", "RATE_Y", "RATE_Z"),
        speed_mps=sign * columns(messages["WHEEL_SPEEDS"], "FRONT_LEFT")[:, 0],
        counters=columns(messages["IMU_ACCEL"], "ACCEL_COUNTER")[:, 0].astype(np.int64),
    )


def test_it_ends_where_it_began_standing(mirrored: Mirrored) -> None:
    ends = slice(0, STANDING_ROWS), slice(-STANDING_ROWS, None)
    for rows in ends:
        assert mirrored.truth.position_m[rows] == pytest.approx(
            np.tile(mirrored.truth.position_m[0], (STANDING_ROWS, 1))
        )
        assert mirrored.truth.rotation[rows].ptp(axis=0) == pytest.approx(0.0, abs=1e-8)
        assert (mirrored.speed_mps[rows] == 0.0).all()
        assert (mirrored.rate_radps[rows] == 0.0).all()
        assert mirrored.force_mps2[rows].ptp(axis=0) == pytest.approx(0.0, abs=1e-9)


def test_message_counters_go_on_from_lap_to_lap(mirrored: Mirrored) -> None:
    two_laps = np.concatenate([mirrored.counters, mirrored.counters])
    assert (np.diff(two_laps) % COUNTER_MODULO == 1).all()


def test_it_drives_forwards_then_in_reverse_without_a_jump(mirrored: Mirrored) -> None:
    half = len(mirrored.speed_mps) // 2
    assert mirrored.speed_mps[:half].min() == 0.0
    assert mirrored.speed_mps[half:].max() == 0.0
    assert mirrored.speed_mps.max() == pytest.approx(-mirrored.speed_mps.min(), abs=0.02)
    rows_s = np.diff(mirrored.truth.time_ns) * 1e-9
    assert np.abs(np.diff(mirrored.speed_mps) / rows_s).max() < 4.0  # m/s^2
    assert np.abs(np.diff(mirrored.force_mps2, axis=0)).max() < 3.0
    way_m = np.linalg.norm(np.diff(mirrored.truth.position_m, axis=0), axis=1).sum()
    assert np.sum(np.abs(mirrored.speed_mps[:-1]) * rows_s) == pytest.approx(way_m, rel=0.002)


@pytest.mark.parametrize("from_row", [60, 500, 1400, 2200], ids="row {}".format)
def test_inertial_data_integrated_gives_the_trajectory(mirrored: Mirrored, from_row: int) -> None:
    rows = range(from_row, from_row + 125)  # 5 s
    time_s = mirrored.truth.time_ns * 1e-9 - mirrored.truth.time_ns[0] * 1e-9
    p = mirrored.truth.position_m
    R = Rotation.from_matrix(mirrored.truth.rotation[from_row])
    dt_s = time_s[from_row + 1] - time_s[from_row - 1]
    v, at = (p[from_row + 1] - p[from_row - 1]) / dt_s, p[from_row]
    for k in rows:
        dt_s = time_s[k + 1] - time_s[k]
        turn = Rotation.from_rotvec(
            0.5 * (mirrored.rate_radps[k] + mirrored.rate_radps[k + 1]) * dt_s
        )
        middle = R * Rotation.from_rotvec(0.5 * turn.as_rotvec())
        force = 0.5 * (mirrored.force_mps2[k] + mirrored.force_mps2[k + 1])
        a = middle.apply(force) + GRAVITY_MPS2
        at, v, R = at + v * dt_s + 0.5 * a * dt_s**2, v + a * dt_s, R * turn
    last = Rotation.from_matrix(mirrored.truth.rotation[rows[-1] + 1])
    assert at == pytest.approx(p[rows[-1] + 1], abs=0.05)
    assert (last.inv() * R).magnitude() < 0.001


def test_images_are_taken_where_the_source_took_them(mirrored: Mirrored) -> None:
    frames = list(read_frames(mirrored.folder / "camera.lcm", CHANNEL))
    originals = list(read_frames(mirrored.source / "camera.lcm", CHANNEL))
    number_of = {frame.data: i for i, frame in enumerate(originals)}
    numbers = [number_of[frame.data] for frame in frames]
    found_p, found_R = poses_at(mirrored.truth, frames)
    source_truth = read_tum(mirrored.source / "ground_truth.tum")
    true_p, true_R = poses_at(source_truth, [originals[i] for i in numbers])
    assert np.linalg.norm(found_p - true_p, axis=1).max() < 0.03
    turned = Rotation.from_matrix(found_R).inv() * Rotation.from_matrix(true_R)
    assert np.degrees(turned.magnitude().max()) < 0.3
    assert all(number % 2 == 1 for number in numbers[1::2]), "even images stay at even places"
    assert len(frames) % 2 == 0, "in the next lap, too"
    gaps_s = np.diff([frame.time_ns for frame in frames]) * 1e-9
    assert gaps_s.min() > 0.09 and gaps_s.max() < 1.0


def poses_at(truth: Trajectory, frames: list[CameraFrame]) -> tuple[Floats, Floats]:
    times = np.array([frame.time_ns for frame in frames], dtype=np.int64)
    return PoseInterpolator(truth).at(times)


@pytest.fixture
def broken(tmp_path: Path) -> Callable[[str, str], Path]:
    """A drive folder that lacks something."""

    def make(dbc: str, truth: str) -> Path:
        drive = tmp_path / "drive"
        drive.mkdir()
        (drive / "vehicle.yaml").write_text(f"can: {{dbc: {dbc}}}\n")
        (drive / "ground_truth.tum").write_text(truth)
        return drive

    return make


@pytest.mark.parametrize(
    ("dbc", "truth", "why"),
    [
        ("toyota.dbc", "", "its CAN messages are not those of"),
        (DBC.name, "1.0 0 0 0 0 0 0 1\n", "expected two or more lines of 8 numbers"),
    ],
)
def test_what_cannot_be_mirrored_is_said(
    broken: Callable[[str, str], Path],
    capsys: pytest.CaptureFixture[str],
    dbc: str,
    truth: str,
    why: str,
) -> None:
    drive = broken(dbc, truth)
    out = drive.with_name("out")
    assert main(["--drive", str(drive), "--out", str(out)]) == 1
    assert re.search(why, capsys.readouterr().err)
    assert not out.exists()

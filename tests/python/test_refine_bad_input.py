# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""What map building says of input that cannot fit, on stretches of KITTI 2011_09_26_drive_0039: it
has to name what is wrong, and must never make a map that is wrong and sure of it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import lcm
import numpy as np
import numpy.typing as npt
import pytest
from clouds import Points, read_laz, write_ply
from programs import done
from refine_0039 import BINS, DATA, build, drive_without, registrations, stretch

from node_pose_table import Table, pose_text

FROM_M, TO_M = 20.0, 70.0

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"{DATA} is not there")


@pytest.fixture(scope="module")
def points() -> Points:
    """The cloud's beginning, in the order it was scanned."""
    return read_laz(DATA / "cloud.laz", 0.45)


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory, kitti_0039: Path, points: Points) -> Table:
    work = tmp_path_factory.mktemp("bad_input")
    return Table(kitti_0039, write_ply(work / "cloud.ply", points), work / "table", BINS)


def place(table: Table, along_m: float) -> npt.NDArray[np.float64]:
    """Where the vehicle was after so much of the drive."""
    positions = table.truth.positions
    return np.array([np.interp(along_m, table.truth.way_m, axis) for axis in positions.T])


def beginning(table: Table, to_m: float) -> tuple[Path, str]:
    """The drive up to there, and the option that tells its initial pose."""
    drive = drive_without(table, f"up_to_{to_m:.0f}", "camera.lcm")
    end_us = table.truth.time_ns[np.searchsorted(table.truth.way_m, to_m)] // 1000
    log = lcm.EventLog(str(drive / "camera.lcm"), "w")
    for event in lcm.EventLog(str(table.drive / "camera.lcm")):
        if event.timestamp < end_us:
            log.write_event(event.timestamp, event.channel, event.data)
    log.close()
    return drive, "--initial-pose=" + pose_text(table.truth.positions[0], table.truth.rotations[0])


def complaint(table: Table, cloud: Path, drive: Path | None = None, *start: str | Path) -> str:
    """Of a build that has to be refused."""
    out = table.work / "refused.tmap"
    start = start or ("--trajectory", stretch(table, FROM_M, TO_M))
    result = build(drive or table.drive, cloud, out, *start)
    assert result.returncode == 1, result.stdout
    assert not out.exists()
    return result.stderr


def test_a_cloud_without_intensities(table: Table, points: Points) -> None:
    cloud = write_ply(table.work / "plain.ply", points[::10, :3])
    assert "no intensities" in complaint(table, cloud)


def test_a_cloud_of_one_intensity(table: Table, points: Points) -> None:
    even = points[::10].copy()
    even[:, 3] = 100.0
    assert "the same intensity, 100" in complaint(table, write_ply(table.work / "even.ply", even))


@pytest.mark.parametrize("knows", ["trajectory", "initial pose"])
def test_a_cloud_elsewhere(table: Table, points: Points, knows: str) -> None:
    shifted = points + np.array([300.0, 0.0, 0.0, 0.0], np.float32)
    cloud = write_ply(table.work / "elsewhere.ply", shifted)
    if knows == "trajectory":
        told = complaint(table, cloud)
    else:
        drive, pose = beginning(table, 30.0)
        told = complaint(table, cloud, drive, pose)
    assert "lies elsewhere" in told
    assert re.search(r"(\d+) of \1 poses see none of it. Cloud: x 2\d\d\.", told)
    assert not registrations(table.work / "refused.tmap")  # told before any was tried


@pytest.mark.parametrize("axes", ["y turned", "z turned", "x and y swapped"])
def test_mirrored_axes(table: Table, points: Points, axes: str) -> None:
    about = place(table, 45.0)
    mirrored = points.copy()
    if axes == "x and y swapped":  # the drive goes north-east: it stays on its own way
        mirrored[:, :2] = points[:, 1::-1] + (about[:2] - about[1::-1])
    else:
        axis = "xyz".index(axes[0])
        mirrored[:, axis] = 2.0 * about[axis] - points[:, axis]
    told = complaint(table, write_ply(table.work / "mirrored.ply", mirrored))
    assert "do not agree" in told
    assert "mirrored" in told


def with_focal_length(scale: float) -> Callable[[str], str]:
    def change(camchain: str) -> str:
        fx, fy, rest = re.findall(r"intrinsics: \[(.*?), (.*?), (.*)\]", camchain)[0]
        new = f"intrinsics: [{scale * float(fx)}, {scale * float(fy)}, {rest}]"
        return re.sub(r"intrinsics: .*", new, camchain)

    return change


def without_distortion(camchain: str) -> str:
    return re.sub(r"distortion_coeffs: .*", "distortion_coeffs: [0, 0, 0, 0]", camchain)


def upside_down(camchain: str) -> str:
    """With the camera's x and y axes the wrong way round."""
    turned = 0

    def turn(row: re.Match[str]) -> str:
        nonlocal turned
        turned += 1
        numbers = [float(v) for v in row[1].split(",")]
        return f"- [{', '.join(repr(-v if turned <= 2 else v) for v in numbers)}]"

    return re.sub(r"- \[(.*)\]", turn, camchain)


@pytest.mark.parametrize(
    ("change", "complains_of"),
    [
        (with_focal_length(0.97), "with some 1.0[24] times the camera's focal length"),
        (without_distortion, r"with some -0\.[12] added to its radial distortion"),
        (upside_down, "do not agree.*extrinsics"),
    ],
    ids=["focal length", "distortion", "extrinsics"],
)
def test_wrong_calibration(
    table: Table,
    change: Callable[[str], str],
    complains_of: str,
    request: pytest.FixtureRequest,
) -> None:
    drive = drive_without(table, request.node.callspec.id.replace(" ", "_"), "camchain.yaml")
    camchain = (table.drive / "camchain.yaml").read_text()
    (drive / "camchain.yaml").write_text(change(camchain))
    assert re.search(complains_of, complaint(table, table.cloud, drive))
    # What was tried is told all the same.
    assert len(registrations(table.work / "refused.tmap")) > 5


@pytest.mark.parametrize("knows", ["trajectory", "initial pose"])
def test_wheel_speeds_in_another_unit(table: Table, knows: str) -> None:
    """Kilometres an hour taken for miles."""
    start: tuple[str | Path, ...] = ()
    if knows == "trajectory":
        drive = drive_without(table, "wheels", "vehicle.yaml")
    else:
        drive, pose = beginning(table, 50.0)  # a folder of its own
        start = (pose, "--odometry", "wheel-imu")
        (drive / "vehicle.yaml").unlink()
    vehicle = (table.drive / "vehicle.yaml").read_text()
    assert "wheel_scale: 1.0" in vehicle
    (drive / "vehicle.yaml").write_text(vehicle.replace("wheel_scale: 1.0", "wheel_scale: 1.6"))
    told = complaint(table, table.cloud, drive, *start)
    assert "more than 1.5 times as far" in told
    assert "unit of the wheel speeds" in told


def test_a_cloud_that_ends_on_the_way(table: Table, points: Points) -> None:
    """Where it ends, nodes are refused; the others are as good as ever."""
    end = place(table, 80.0)
    ahead = place(table, 90.0) - end
    ahead /= np.linalg.norm(ahead)
    beyond = (points[:, :3] - end) @ ahead > 0.0
    cloud = write_ply(table.work / "half.ply", points[~beyond])
    out = table.work / "half.tmap"
    result = build(table.drive, cloud, out, "--trajectory", stretch(table, FROM_M, 115.0))
    assert result.returncode == 0, result.stderr
    nodes = json.loads(done(BINS / "topoloc-map", "inspect", out, "--json", "-"))["build"]["nodes"]
    along = np.array([(np.array(node["position_m"]) - end) @ ahead for node in nodes])
    rejected = np.array([node["rejected"] is not None for node in nodes])
    assert rejected[along > 25.0].all()
    assert not rejected[along < -10.0].any()
    figures = table.compare(out)
    print(figures)
    assert figures["median_m"] < 0.2
    assert figures["worst_m"] < 0.6
    assert figures["normalised"] < 2.5


def test_an_initial_pose_and_odometry_alone(table: Table) -> None:
    drive, pose = beginning(table, 60.0)
    out = table.work / "odometry.tmap"
    result = build(drive, table.cloud, out, pose, "--odometry", "wheel-imu")
    assert result.returncode == 0, result.stderr
    figures = table.compare(out)
    print(figures)
    assert figures["accepted"] >= 0.6
    assert figures["worst_m"] < 1.0

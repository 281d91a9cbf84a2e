# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""One point cloud in world axes from the LiDAR scans of a Complex Urban Dataset recording."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from topoloc_import.complex_urban_files import files_by_time, read_mounting
from topoloc_import.errors import DriveImportError
from topoloc_import.kitti_calibration import Matrix
from topoloc_import.progress import progress
from topoloc_import.trajectory import PoseInterpolator, Trajectory
from topoloc_import.voxel_cloud import VoxelCloud

Array = npt.NDArray[np.float64]

# Folder in sensor_data: name of the calibration file after "Vehicle2".
LIDARS = {
    "VLP_left": "LeftVLP",
    "VLP_right": "RightVLP",
    "SICK_back": "BackSick",
    "SICK_middle": "MiddleSick",
}
REVOLUTION_NS = 100_000_000  # a VLP-16 at 600 turns a minute
LAST_FIRING_RAD = np.radians(2.0)  # beams of the last firing lie around that of the last point
SICK_POINTS = 286
SICK_ANGLE_RAD = np.radians(-5.0 + 190.0 / (SICK_POINTS - 1) * np.arange(SICK_POINTS))
MIN_RANGE_M = 0.5  # a lost return has range 0
# The car itself, in vehicle axes (rear axle; x forward, y left, z up): generous, not measured.
CAR_MIN_M = np.array([-1.3, -1.1, -1.0])
CAR_MAX_M = np.array([4.0, 1.1, 2.3])
MAX_POSE_GAP_NS = 500_000_000
SCANS_AT_ONCE = 20


@dataclass(frozen=True)
class CloudOptions:
    """What --cloud puts into cloud.ply."""

    voxel_m: float = 0.1  # 0: all points
    max_range_m: float = 80.0
    lidars: tuple[str, ...] = ("VLP_left", "VLP_right")
    deskew: bool = False


@dataclass(frozen=True)
class Scan:
    """One file of a LiDAR: its time [ns] is that of the revolution's end."""

    time_ns: int
    file: Path
    lidar: str


def write_cloud(
    path: Path, source: Path, T_world_vehicle: Trajectory, options: CloudOptions, comment: str
) -> None:
    """Binary PLY of the scans within the trajectory, placed by the vehicle's interpolated pose,
    in the order of time. A few scans are in memory at once."""
    mountings = {
        lidar: read_mounting(source / "calibration", LIDARS[lidar]) for lidar in options.lidars
    }
    scans = find_scans(source, options.lidars)
    inside = [s for s in scans if has_pose(T_world_vehicle.time_ns, s.time_ns)]
    if not inside:
        raise DriveImportError(f"{source / 'sensor_data'}: no scan lies inside the trajectory")
    if len(inside) < len(scans):
        print(
            f"scans: {len(scans) - len(inside)} of {len(scans)} have no poses around them; left out"
        )
    poses = PoseInterpolator(T_world_vehicle)
    rejected: Counter[str] = Counter()
    with VoxelCloud(path, options.voxel_m, comment) as cloud:
        batch: list[tuple[Array, Array]] = []
        for number, scan in enumerate(progress(inside, "scans"), start=1):
            batch.append(place_scan(scan, poses, mountings[scan.lidar], options, rejected))
            if len(batch) == SCANS_AT_ONCE or number == len(inside):
                cloud.add(
                    np.concatenate([p for p, _ in batch]), np.concatenate([i for _, i in batch])
                )
                batch.clear()
    if not cloud.points:
        raise DriveImportError(f"{source / 'sensor_data'}: no usable point in {len(inside)} scans")
    for reason, count in sorted((+rejected).items()):  # those above zero
        print(f"scans: {count} {reason}; left out")


def find_scans(source: Path, lidars: tuple[str, ...]) -> list[Scan]:
    """The scans of these LiDARs in the order of time."""
    scans = []
    for lidar in lidars:
        folder = source / "sensor_data" / lidar
        files = files_by_time(folder, "bin")
        if not files:
            raise DriveImportError(f"{folder}: no scan")
        scans += [Scan(time_ns, file, lidar) for time_ns, file in files]
    return sorted(scans, key=lambda s: (s.time_ns, s.lidar))


def has_pose(pose_time_ns: npt.NDArray[np.int64], time_ns: int) -> bool:
    """Whether a time lies between two poses that are not too far apart."""
    right = int(np.searchsorted(pose_time_ns, time_ns))
    if right == len(pose_time_ns):
        return False
    if pose_time_ns[right] == time_ns:
        return True
    return right > 0 and bool(pose_time_ns[right] - pose_time_ns[right - 1] <= MAX_POSE_GAP_NS)


def place_scan(
    scan: Scan,
    poses: PoseInterpolator,
    T_vehicle_lidar: Matrix,
    options: CloudOptions,
    rejected: Counter[str],
) -> tuple[Array, Array]:
    """World points (n, 3) [m] and intensities (n) of one scan."""
    read = read_sick if scan.lidar.startswith("SICK") else read_velodyne
    p_lidar, intensity = read(scan.file)
    if not len(p_lidar):
        rejected["scans are empty"] += 1
        return p_lidar, intensity
    time_ns = np.full(len(p_lidar), scan.time_ns, dtype=np.int64)
    finite = np.isfinite(p_lidar).all(axis=1) & np.isfinite(intensity)
    rejected["points are not finite"] += int(np.count_nonzero(~finite))
    p_lidar, intensity, time_ns = p_lidar[finite], intensity[finite], time_ns[finite]
    if options.deskew and read is read_velodyne:
        time_ns = time_ns - age_in_revolution_ns(p_lidar)
    p_vehicle = p_lidar @ T_vehicle_lidar[:3, :3].T + T_vehicle_lidar[:3, 3]
    on_car = ((p_vehicle > CAR_MIN_M) & (p_vehicle < CAR_MAX_M)).all(axis=1)
    range_m = np.linalg.norm(p_lidar, axis=1)
    near = on_car | (range_m < MIN_RANGE_M)
    far = range_m > options.max_range_m
    rejected["points are on the car or lost"] += int(np.count_nonzero(near))
    rejected[f"points are beyond {options.max_range_m:g} m"] += int(np.count_nonzero(far & ~near))
    keep = ~near & ~far
    if not keep.any():
        return np.empty((0, 3)), np.empty(0)
    position, rotation = poses.at(time_ns[keep])
    p_world = np.einsum("nij,nj->ni", rotation, p_vehicle[keep]) + position
    return p_world, intensity[keep]


def age_in_revolution_ns(p_lidar: Array) -> npt.NDArray[np.int64]:
    """How long before the end of the revolution each point was seen, if the file's last point is
    the last one seen and the scanner turns clockwise, from larger to smaller azimuth."""
    azimuth = np.arctan2(p_lidar[:, 1], p_lidar[:, 0])
    back = np.mod(azimuth - azimuth[-1:] + LAST_FIRING_RAD, 2 * np.pi) - LAST_FIRING_RAD
    turn = back / (2 * np.pi)
    age_ns: npt.NDArray[np.int64] = np.rint(turn * REVOLUTION_NS).astype(np.int64)
    return age_ns


def read_velodyne(file: Path) -> tuple[Array, Array]:
    """Points (n, 3) [m] in scanner axes and reflectivities of float32 x y z reflectivity."""
    values = read_floats(file, 4)
    return values[:, :3], values[:, 3]


def read_sick(file: Path) -> tuple[Array, Array]:
    """Points (n, 3) [m] in scanner axes (in its plane z = 0) and remission values of float32 range,
    remission: 286 beams from -5 to 185 degrees, counted from x towards y."""
    values = read_floats(file, 2)
    if len(values) not in (0, SICK_POINTS):
        raise DriveImportError(f"{file}: expected {SICK_POINTS} beams, found {len(values)}")
    angle, range_m = SICK_ANGLE_RAD[: len(values)], values[:, 0]
    points = np.stack([range_m * np.cos(angle), range_m * np.sin(angle), 0 * range_m], axis=1)
    return points, values[:, 1]


def read_floats(file: Path, columns: int) -> Array:
    """(n, columns) of little-endian float32."""
    try:
        size = file.stat().st_size
        if size % (4 * columns) != 0:
            raise DriveImportError(f"{file}: {size} bytes are no multiple of {columns} float32")
        raw = np.fromfile(file, dtype="<f4")
    except OSError as error:
        raise DriveImportError(f"{file}: {error.strerror}") from error
    return raw.reshape(-1, columns).astype(np.float64)

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""One point cloud in world axes from the scans of a drive, motion taken out of each scan."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from topoloc_import.errors import DriveImportError
from topoloc_import.kitti_calibration import Matrix, inverse
from topoloc_import.progress import progress
from topoloc_import.trajectory import PoseInterpolator, Trajectory
from topoloc_import.voxel_cloud import VoxelCloud

REVOLUTION_NS = 103_300_000  # the HDL-64E of KITTI turns at 9.68 Hz
MAX_RANGE_M = 80.0
# The car itself, in scanner axes (x forward, y left, z up).
CAR_MIN_M = np.array([-2.6, -1.2, -1.6])
CAR_MAX_M = np.array([2.7, 1.2, np.inf])


def write_cloud(
    path: Path, scans: list[tuple[int, Path]], trajectory: Trajectory, T_velo_imu: Matrix
) -> None:
    """Binary PLY. Scans that reach out of the trajectory by more than a revolution are left out
    and reported; the first scan of a drive usually starts just before the first pose."""
    poses = PoseInterpolator(trajectory)
    T_imu_velo = inverse(T_velo_imu)
    inside = [s for s in scans if poses.covers(s[0], REVOLUTION_NS // 2)]
    if not inside:
        raise DriveImportError("no scan lies inside the trajectory")
    if len(inside) < len(scans):
        print(f"scans: {len(scans) - len(inside)} of {len(scans)} lie outside the trajectory")
    with VoxelCloud(path, 0.0, "all points; axes: docs/drive-folder.md") as cloud:
        for scan in progress(inside, "scans"):
            cloud.add(*place_scan(scan, poses, T_imu_velo))


def place_scan(
    scan: tuple[int, Path], poses: PoseInterpolator, T_imu_velo: Matrix
) -> tuple[Matrix, Matrix]:
    """World points (n, 3) of one scan and their intensities. Its time stamp is when the scanner
    looks forward; it turns clockwise, so what lies to the left (azimuth > 0) was seen before."""
    time_ns, file = scan
    try:
        raw = np.fromfile(file, dtype="<f4")
    except OSError as error:
        raise DriveImportError(f"{file}: {error.strerror}") from error
    if raw.size == 0 or raw.size % 4 != 0 or not np.isfinite(raw).all():
        raise DriveImportError(f"{file}: expected finite float32 x y z reflectance")
    points = raw.reshape(-1, 4).astype(np.float64)
    p_velo = points[:, :3]
    on_car = ((p_velo > CAR_MIN_M) & (p_velo < CAR_MAX_M)).all(axis=1)
    keep = ~on_car & (np.linalg.norm(p_velo, axis=1) <= MAX_RANGE_M)
    p_velo, reflectance = p_velo[keep], points[keep, 3]
    azimuth = np.arctan2(p_velo[:, 1], p_velo[:, 0])
    offset_ns = np.rint(azimuth / (2 * np.pi) * REVOLUTION_NS).astype(np.int64)
    position, rotation = poses.at(time_ns - offset_ns)
    p_imu = p_velo @ T_imu_velo[:3, :3].T + T_imu_velo[:3, 3]
    p_world = np.einsum("nij,nj->ni", rotation, p_imu) + position
    return p_world, reflectance

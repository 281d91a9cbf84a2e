# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""KITTI's calibration files, whose `NAME: numbers` lines other data sets have too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from topoloc_import.errors import DriveImportError

Matrix = npt.NDArray[np.float64]


class CalibrationFile:
    """`NAME: numbers` lines of one file; other lines are passed over."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._values: dict[str, Matrix] = {}
        try:
            text = path.read_text(encoding="utf-8")
        except OSError as error:
            raise DriveImportError(f"{path}: {error.strerror}") from error
        for line in text.splitlines():
            key, _, rest = line.partition(":")
            try:
                self._values[key.strip()] = np.array([float(word) for word in rest.split()])
            except ValueError:
                continue  # calib_time is a date

    def has(self, key: str) -> bool:
        """Whether there is such a line."""
        return key in self._values

    def matrix(self, key: str, *shape: int) -> Matrix:
        """The finite numbers of a key, shaped."""
        values = self._values.get(key)
        if values is None:
            raise DriveImportError(f"{self.path}: no {key}")
        if values.size != int(np.prod(shape)) or not np.isfinite(values).all():
            raise DriveImportError(f"{self.path}: {key}: expected {int(np.prod(shape))} numbers")
        return values.reshape(shape)

    def transform(self) -> Matrix:
        """4x4 rigid transform of a file with R and T. R is printed with six digits: made exact."""
        result = np.eye(4)
        R = self.matrix("R", 3, 3)
        try:
            result[:3, :3] = nearest_rotation(R)
        except DriveImportError as error:
            raise DriveImportError(f"{self.path}: {error}") from error
        result[:3, 3] = self.matrix("T", 3)
        return result


def nearest_rotation(matrix: Matrix) -> Matrix:
    """The rotation closest to a matrix that is one but for rounding."""
    u, singular, vt = np.linalg.svd(matrix)
    rotation: Matrix = u @ vt
    if np.linalg.det(rotation) < 0 or np.abs(singular - 1).max() > 1e-3:
        raise DriveImportError(f"not a rotation matrix: {matrix.tolist()}")
    return rotation


def inverse(transform: Matrix) -> Matrix:
    """Inverse of a 4x4 rigid transform."""
    result = np.eye(4)
    result[:3, :3] = transform[:3, :3].T
    result[:3, 3] = -transform[:3, :3].T @ transform[:3, 3]
    return result


class KittiCalibration:
    """The three files of a recording day. T_a_b maps points from b to a; the cameras count from 0
    (00, left grey)."""

    def __init__(self, folder: Path) -> None:
        self.cameras = CalibrationFile(folder / "calib_cam_to_cam.txt")
        self.T_velo_imu = CalibrationFile(folder / "calib_imu_to_velo.txt").transform()
        self.T_cam0_velo = CalibrationFile(folder / "calib_velo_to_cam.txt").transform()

    def raw_camera(self) -> tuple[Matrix, Matrix, Matrix]:
        """K (3x3), distortion k1 k2 p1 p2 k3 and T_cam_imu of camera 00 as it is."""
        K = self.cameras.matrix("K_00", 3, 3)
        return K, self.cameras.matrix("D_00", 5), self.T_cam0_velo @ self.T_velo_imu

    def rectified_camera(self, camera: str = "00") -> tuple[Matrix, Matrix]:
        """K (3x3) and T_cam_imu of a camera after rectification, which turns all of them into the
        axes of camera 00 turned by R_rect_00."""
        P = self.cameras.matrix(f"P_rect_{camera}", 3, 4)
        T_rect_cam0 = np.eye(4)
        T_rect_cam0[:3, :3] = nearest_rotation(self.cameras.matrix("R_rect_00", 3, 3))
        T_rect_cam0[:3, 3] = np.linalg.solve(P[:, :3], P[:, 3])  # where the camera sits beside 00
        return P[:, :3], T_rect_cam0 @ self.T_cam0_velo @ self.T_velo_imu

    def rectified_size_px(self, camera: str) -> tuple[int, int] | None:
        """Width and height after rectification, where the file tells."""
        if not self.cameras.has(f"S_rect_{camera}"):
            return None
        width, height = self.cameras.matrix(f"S_rect_{camera}", 2).tolist()
        return round(width), round(height)

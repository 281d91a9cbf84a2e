# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The camera frames of a drive folder, undistorted as the localiser does, and where they are."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import lcm
import numpy as np
import numpy.typing as npt
import yaml
from PIL import Image
from scipy.ndimage import map_coordinates, uniform_filter
from scipy.spatial.transform import Rotation, Slerp

from lcm_types import message_types

Floats = npt.NDArray[np.float64]
Grey = npt.NDArray[np.float32]

GRAY, MJPEG = 1497715271, 1196444237
# The defaults of matching.* in vehicle.yaml, whatever the drive says: drives are compared.
WIDTH_PX, HEIGHT_PX, FOCAL_PX = 640, 384, 450.0


class Undistorter:
    """A Kalibr camera's images into the matching camera."""

    def __init__(self, camera: dict[str, Any]) -> None:
        fx, fy, cx, cy = (float(v) for v in camera["intrinsics"])
        u, v = np.meshgrid(np.arange(WIDTH_PX), np.arange(HEIGHT_PX))
        x = (u - 0.5 * (WIDTH_PX - 1)) / FOCAL_PX
        y = (v - 0.5 * (HEIGHT_PX - 1)) / FOCAL_PX
        x, y = self._distorted(x, y, camera)
        self.columns, self.rows = fx * x + cx, fy * y + cy
        width, height = camera["resolution"]
        inside = (self.columns >= 0) & (self.columns <= width - 1)
        self.seen = inside & (self.rows >= 0) & (self.rows <= height - 1)
        # Averaged first where the target is coarser: aliases do not repeat.
        self.shrink = max(1, int(fx / FOCAL_PX))

    @staticmethod
    def _distorted(x: Floats, y: Floats, camera: dict[str, Any]) -> tuple[Floats, Floats]:
        k = [float(v) for v in camera.get("distortion_coeffs", [])] + [0.0] * 5
        r2 = x * x + y * y
        model = camera.get("distortion_model", "none")
        if model == "equidistant":
            r = np.sqrt(r2)
            theta = np.arctan(r)
            t2 = theta * theta
            bent = theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))))
            scale = np.where(r > 1e-9, bent / np.maximum(r, 1e-9), 1.0)
            return x * scale, y * scale
        if model == "none":
            return x, y
        radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))
        return (
            x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
            y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y,
        )

    def __call__(self, raw: Grey) -> Grey:
        if self.shrink > 1:
            raw = uniform_filter(raw, self.shrink)
        out: Grey = map_coordinates(raw, [self.rows, self.columns], order=1, mode="nearest")
        out[~self.seen] = 0.0
        return out


@dataclass(frozen=True)
class Frame:
    """An undistorted image and the true pose of its camera."""

    time_s: float
    image: Grey
    rotation: Rotation  # world from camera
    position_m: Floats


class Poses:
    """A TUM file, interpolated."""

    def __init__(self, path: Path) -> None:
        table = np.loadtxt(path, comments="#", ndmin=2)
        self.time_s: Floats = table[:, 0]
        self.positions: Floats = table[:, 1:4]
        self.rotations = Slerp(self.time_s, Rotation.from_quat(table[:, 4:8]))

    def at(self, time_s: float) -> tuple[Rotation, Floats] | None:
        if not self.time_s[0] <= time_s <= self.time_s[-1]:
            return None
        position = np.array([np.interp(time_s, self.time_s, axis) for axis in self.positions.T])
        return self.rotations(time_s), position


# Place in the log, and the camera's pose: world from camera.
Camera = tuple[int, Rotation, Floats]


class DriveImages:
    """Where all frames of a drive are, and the frames themselves on demand."""

    def __init__(self, drive: Path) -> None:
        vehicle = yaml.safe_load((drive / "vehicle.yaml").read_text())
        self.log = drive / "camera.lcm"
        if "camera" not in (vehicle or ()) or not self.log.is_file():
            raise ValueError(f"{drive}: a drive without camera")
        section = vehicle["camera"]
        chain = yaml.safe_load((drive / section["calibration"]).read_text())
        camera = chain[section.get("name", "cam0")]
        self.undistort = Undistorter(camera)
        T_cam_imu = np.array(camera["T_cam_imu"], dtype=float)
        self.R_imu_cam = Rotation.from_matrix(T_cam_imu[:3, :3].T)
        self.p_imu_cam: Floats = -T_cam_imu[:3, :3].T @ T_cam_imu[:3, 3]
        self.shift_s = float(camera.get("timeshift_cam_imu", 0.0))
        self.channel = section.get("channel", "CAMERA")
        self.poses = Poses(drive / "ground_truth.tum")
        self.mask = self.undistort.seen
        with tempfile.TemporaryDirectory() as folder:
            self.image_type = message_types(Path(folder)).image_t
        self.cameras: list[Camera] = []
        for place, message in self._messages():
            pose = self.poses.at(message.utime * 1e-6 + self.shift_s)
            if pose is not None:
                rotation, position = pose
                centre = position + rotation.apply(self.p_imu_cam)
                self.cameras.append((place, rotation * self.R_imu_cam, centre))

    def _messages(self) -> Iterator[tuple[int, Any]]:
        for place, event in enumerate(lcm.EventLog(str(self.log), "r")):
            if event.channel == self.channel:
                yield place, self.image_type.decode(event.data)

    def frames(self, wanted: set[int]) -> dict[int, Frame]:
        """The frames at these places of `cameras`."""
        places = {self.cameras[i][0]: i for i in wanted}
        out: dict[int, Frame] = {}
        for place, message in self._messages():
            if place in places:
                i = places[place]
                _, rotation, position = self.cameras[i]
                image = self.undistort(decode(message))
                out[i] = Frame(message.utime * 1e-6, image, rotation, position)
        return out


def decode(message: Any) -> Grey:
    if message.pixelformat == MJPEG:
        with Image.open(io.BytesIO(bytes(message.data))) as image:
            return np.asarray(image.convert("L"), dtype=np.float32)
    if message.pixelformat != GRAY:
        raise ValueError(f"pixel format {message.pixelformat}: neither GRAY nor MJPEG")
    rows = np.frombuffer(bytes(message.data), dtype=np.uint8)
    rows = rows[: message.height * message.row_stride].reshape(message.height, message.row_stride)
    return rows[:, : message.width].astype(np.float32)

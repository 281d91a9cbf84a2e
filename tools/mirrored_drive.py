#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Makes a closed drive of a recorded one: there, a halt, the same way back in reverse, a halt.

It ends where it began, standing, so that `topoloc-replay --loop` may play it for hours without a
jump. Images are those of the source, at the times when the vehicle is where they were taken.
Inertial data and speed are computed from the smoothed reference of the source, not recorded: they
have no noise and no bias, and agree with the reference by construction. For soak tests and benches
without end; not for figures of accuracy.

An image has an even place in the log where it had one in the source's, so a map of the source's
even frames can be tried with the odd ones.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml
from scipy.interpolate import make_smoothing_spline
from scipy.spatial.transform import Rotation

from topoloc_import.can_log import COUNTER_MODULO, InertialRow
from topoloc_import.drive_folder import CHANNEL, DBC, create_folder, write_camera, write_sensors
from topoloc_import.errors import DriveImportError
from topoloc_import.lcm_log import CameraFrame, read_frames
from topoloc_import.trajectory import Trajectory, read_tum, write_tum

EXAMPLES = """examples:
  tools/topoloc-import kitti-0039 ../shared/data/kitti_0039 --out drives/0039
  .venv/bin/python tools/mirrored_drive.py --drive drives/0039 --out drives/0039_mirrored
  topoloc-replay --drive drives/0039_mirrored --loop --can vcan0"""

GRAVITY_MPS2 = np.array([0.0, 0.0, -9.81])  # world axes: estimator.gravity_mps2
RAMP_S = 2.5  # from standing to the recorded speed, and back
STANDING_S = 3.0  # at least, at each end
# Parts of the motion above about 3 Hz are the reference's noise.
SMOOTHING = 2e-4

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """Poses and their derivatives at a sequence of times, world axes; rates in IMU axes."""

    position_m: Array
    velocity_mps: Array
    acceleration_mps2: Array
    rotation: Array  # R_world_imu
    rate_radps: Array


class Course:
    """A trajectory, smoothed: motion over progress, which is the recorded time."""

    def __init__(self, truth: Trajectory) -> None:
        self._start_ns = int(truth.time_ns[0])
        time_s = self.progress(truth.time_ns)
        angles = Rotation.from_matrix(truth.rotation).as_euler("ZYX")
        angles[:, 0] = np.unwrap(angles[:, 0])
        channels = np.concatenate([truth.position_m, angles], axis=1)
        self._splines = make_smoothing_spline(time_s, channels, lam=SMOOTHING)

    def progress(self, time_ns: npt.NDArray[np.int64]) -> Array:
        return np.asarray((time_ns - self._start_ns) * 1e-9)

    def motion(self, progress: Array, rate: Array, change: Array) -> Motion:
        """`rate` and `change`: first and second derivative of the progress over time."""
        at, per_s, per_s2 = (self._splines(progress, nu=order) for order in range(3))
        rate = rate[:, None]
        yaw_rate, pitch_rate, roll_rate = (per_s * rate)[:, 3:].T
        (sp, sr), (cp, cr) = np.sin(at[:, 4:].T), np.cos(at[:, 4:].T)
        turn = [
            roll_rate - sp * yaw_rate,
            cr * pitch_rate + sr * cp * yaw_rate,
            -sr * pitch_rate + cr * cp * yaw_rate,
        ]
        return Motion(
            position_m=at[:, :3],
            velocity_mps=(per_s * rate)[:, :3],
            acceleration_mps2=(per_s2 * rate**2 + per_s * change[:, None])[:, :3],
            rotation=Rotation.from_euler("ZYX", at[:, 3:]).as_matrix(),
            rate_radps=np.stack(turn, axis=1),
        )


class Leg:
    """Progress over time from standing to standing: slow at both ends, as recorded in between."""

    def __init__(self, length_s: float) -> None:
        if length_s < RAMP_S:
            raise DriveImportError(f"{length_s:.1f} s of images: at least {RAMP_S} s are needed")
        self.duration_s = length_s + RAMP_S
        self._length_s = length_s

    def at(self, time_s: Array) -> tuple[Array, Array, Array]:
        """Progress and its first two derivatives; standing before and after."""
        second_half = time_s > 0.5 * self.duration_s
        from_halt = np.where(second_half, self.duration_s - time_s, time_s)
        x = np.clip(from_halt / RAMP_S, 0.0, 1.0)
        way = RAMP_S * (x**3 - 0.5 * x**4) + np.maximum(from_halt - RAMP_S, 0.0)
        rate = 3.0 * x**2 - 2.0 * x**3
        change = 6.0 * x * (1.0 - x) / RAMP_S
        return (
            np.where(second_half, self._length_s - way, way),
            rate,
            np.where(second_half, -change, change),
        )

    def time_of(self, progress: Array) -> Array:
        grid_s = np.arange(0.0, self.duration_s, 1e-3)
        return np.interp(progress, self.at(grid_s)[0], grid_s)


class ThereAndBack:
    """The timetable of the closed drive: when the vehicle is how far, and when images are taken."""

    def __init__(self, image_progress: Array) -> None:
        self._from = float(image_progress[0])
        self._leg = Leg(float(image_progress[-1]) - self._from)
        interval_s = float(np.median(np.diff(image_progress)))
        # Even, odd and odd: images keep even or odd places, in lap after lap.
        n = 2 * int(np.ceil(0.5 * STANDING_S / interval_s))
        standing = [np.arange(count) * interval_s for count in (n, n + 1, n + 1)]
        self._forward_s = float(standing[0][-1])
        self._back_s = self._forward_s + self._leg.duration_s + float(standing[1][-1])
        home_s = self._back_s + self._leg.duration_s
        self.duration_s = home_s + float(standing[2][-1]) + interval_s
        there_s = self._leg.time_of(image_progress[1:-1] - self._from)
        last = len(image_progress) - 1
        self.image_times_s: Array = np.concatenate(
            [
                standing[0],
                self._forward_s + there_s,
                self._forward_s + self._leg.duration_s + standing[1],
                home_s - there_s[::-1],
                home_s + standing[2],
            ]
        )
        way = np.arange(1, last)
        self.images: npt.NDArray[np.int64] = np.concatenate(
            [[0] * n, way, [last] * (n + 1), way[::-1], [0] * (n + 1)]
        ).astype(np.int64)

    def at(self, time_s: Array) -> tuple[Array, Array, Array]:
        """Progress of the recorded time, and its first two derivatives."""
        there = self._leg.at(time_s - self._forward_s)
        back = self._leg.at(time_s - self._back_s)
        progress, rate, change = (a - b for a, b in zip(there, back, strict=True))
        return self._from + progress, rate, change


class MirroredDrive:
    """The closed drive, ready to be written."""

    def __init__(self, source: Path) -> None:
        self._source = source
        self._vehicle = yaml.safe_load((source / "vehicle.yaml").read_text(encoding="utf-8"))
        if self._vehicle["can"]["dbc"] != DBC.name:
            raise DriveImportError(f"{source}: its CAN messages are not those of {DBC.name}")
        truth = read_tum(source / "ground_truth.tum")
        self._course = Course(truth)
        self._frames = places_with_reference(source / "camera.lcm", truth)
        taken_ns = np.array([frame.time_ns for frame in self._frames], dtype=np.int64)
        self._table = ThereAndBack(self._course.progress(taken_ns))
        self._start_ns = int(truth.time_ns[0])
        self._row_s = self._period_s(truth)

    def _period_s(self, truth: Trajectory) -> float:
        """About that of the source; message counters go on from lap to lap."""
        period_s = float(np.median(np.diff(truth.time_ns))) * 1e-9
        rounds = round(self._table.duration_s / period_s / COUNTER_MODULO)
        return self._table.duration_s / (rounds * COUNTER_MODULO)

    def write(self, folder: Path) -> None:
        time_s = np.arange(round(self._table.duration_s / self._row_s)) * self._row_s
        motion = self._course.motion(*self._table.at(time_s))
        time_ns = self._stamps(time_s)
        write_sensors(folder, self._rows(time_ns, motion))
        write_tum(
            folder / "ground_truth.tum", Trajectory(time_ns, motion.position_m, motion.rotation)
        )
        write_camera(folder, self._images())
        for name in self._calibration_files():
            shutil.copyfile(self._source / name, folder / name)

    def _stamps(self, time_s: Array) -> npt.NDArray[np.int64]:
        """Whole microseconds, as CAN logs have them."""
        time_us = np.rint(self._start_ns / 1000 + 1e6 * time_s)
        return np.asarray(time_us, dtype=np.int64) * 1000

    def _rows(self, time_ns: npt.NDArray[np.int64], motion: Motion) -> Iterator[InertialRow]:
        into_imu = np.swapaxes(motion.rotation, 1, 2)
        felt = motion.acceleration_mps2 - GRAVITY_MPS2
        force = np.einsum("nij,nj->ni", into_imu, felt)
        speed = self._wheel_speed(np.einsum("nij,nj->ni", into_imu, motion.velocity_mps), motion)
        for t, f, w, v in zip(
            time_ns.tolist(), force.tolist(), motion.rate_radps.tolist(), speed, strict=True
        ):
            yield InertialRow(t, (f[0], f[1], f[2]), (w[0], w[1], w[2]), v)

    def _wheel_speed(self, velocity_imu: Array, motion: Motion) -> list[float]:
        """Forward velocity at the wheels' reference point, as the filter models it."""
        mounting = self._vehicle["vehicle"]
        roll, pitch, yaw = mounting["rotation_vehicle_imu_rpy_rad"]
        R_vehicle_imu = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
        lever = np.cross(motion.rate_radps, mounting["wheel_reference_imu_m"])
        forward = (velocity_imu + lever) @ R_vehicle_imu[0]
        return [float(v) for v in forward / mounting["wheel_scale"]]

    def _images(self) -> Iterator[CameraFrame]:
        stamps = self._stamps(self._table.image_times_s).tolist()
        for time_ns, image in zip(stamps, self._table.images.tolist(), strict=True):
            yield replace(self._frames[image], time_ns=time_ns)

    def _calibration_files(self) -> Sequence[str]:
        camera, imu = self._vehicle["camera"], self._vehicle["imu"]
        return ["vehicle.yaml", camera["calibration"], imu["calibration"]]


def places_with_reference(log: Path, truth: Trajectory) -> list[CameraFrame]:
    """Images from the first odd one to the last odd one within the reference: the vehicle stands
    where they were taken."""
    frames = list(read_frames(log, CHANNEL))
    first_ns, last_ns = int(truth.time_ns[0]), int(truth.time_ns[-1])
    odd = [i for i in range(1, len(frames), 2) if first_ns <= frames[i].time_ns <= last_ns]
    if len(odd) < 2:
        raise DriveImportError(f"{log}: fewer than two odd images within the reference")
    return frames[odd[0] : odd[-1] + 1]


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--drive", type=Path, required=True, help="imported drive folder")
    parser.add_argument("--out", type=Path, required=True, help="drive folder to make")
    parser.add_argument("--force", action="store_true", help="replace an existing drive folder")
    args = parser.parse_args(arguments)
    try:
        create_folder(args.out, args.force, lambda folder: MirroredDrive(args.drive).write(folder))
    except (DriveImportError, OSError, KeyError) as error:
        print(f"mirrored_drive: {error}", file=sys.stderr)
        return 1
    print(f"{args.out}: made of {args.drive}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Files of a Complex Urban Dataset recording: tables, calibration, files named by their time."""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml

from topoloc_import.errors import DriveImportError
from topoloc_import.kitti_calibration import CalibrationFile, Matrix

Array = npt.NDArray[np.float64]

# More rows out of time order than this share (and more than a few) are no glitch.
MAX_REJECTED_SHARE = 0.01
MIN_REJECTED = 3
RADTAN_NAMES = ("plumb_bob", "radtan")


@dataclass(frozen=True)
class Table:
    """Rows of a CSV file: times [ns], increasing, the other columns, and where each row stands."""

    path: Path
    time_ns: npt.NDArray[np.int64]
    values: Array  # (n, columns)
    line: npt.NDArray[np.int64]


def read_table(path: Path, columns: int) -> Table:
    """A CSV file without header, `time[ns]` and so many more numbers per line. Malformed lines and
    numbers that are not finite are errors; rows not later than all before them are left out and
    reported, unless there are too many."""
    times: list[int] = []
    values = array("d")
    lines: list[int] = []
    rejected: list[int] = []
    for number, line in text_lines(path):
        words = line.split(",")
        if len(words) != columns + 1:
            raise DriveImportError(
                f"{path}:{number}: expected {columns + 1} columns, found {len(words)}"
            )
        try:
            time_ns, row = int(words[0]), [float(word) for word in words[1:]]
        except ValueError as error:
            raise DriveImportError(f"{path}:{number}: {error}") from error
        if time_ns <= 0 or not all(map(math.isfinite, row)):
            raise DriveImportError(f"{path}:{number}: not finite, or no time")
        if times and time_ns <= times[-1]:
            rejected.append(number)
            continue
        times.append(time_ns)
        values.extend(row)
        lines.append(number)
    if rejected:
        total = len(times) + len(rejected)
        message = (
            f"{len(rejected)} of {total} rows are not later than all before them"
            f" (first: line {rejected[0]})"
        )
        if len(rejected) > max(MIN_REJECTED, MAX_REJECTED_SHARE * total):
            raise DriveImportError(f"{path}: {message}")
        print(f"{path.name}: {message}; left out")
    if len(times) < 2:
        raise DriveImportError(f"{path}: fewer than two rows")
    rows = np.array(values).reshape(-1, columns)
    return Table(path, np.array(times, np.int64), rows, np.array(lines, np.int64))


def text_lines(path: Path) -> Iterator[tuple[int, str]]:
    """(number, line) of the lines of a text file that are not blank."""
    try:
        with path.open(encoding="ascii") as file:
            for number, line in enumerate(file, start=1):
                if line.strip():
                    yield number, line
    except OSError as error:
        raise DriveImportError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise DriveImportError(f"{path}: not a text file: {error}") from error


def files_by_time(folder: Path, suffix: str) -> list[tuple[int, Path]]:
    """(time [ns], file) of all `<time>.suffix` of a folder, in the order of time."""
    if not folder.is_dir():
        raise DriveImportError(f"{folder}: no such folder")
    files = []
    for file in folder.glob(f"*.{suffix}"):
        if not file.stem.isascii() or not file.stem.isdigit():
            raise DriveImportError(f"{file}: the name is not a time in nanoseconds")
        files.append((int(file.stem), file))
    return sorted(files)


def read_mounting(folder: Path, sensor: str) -> Matrix:
    """T_vehicle_sensor of calibration/Vehicle2<sensor>.txt: R and T take points of the sensor to
    the vehicle's axes (x forward, y left, z up), whatever the name says."""
    return CalibrationFile(folder / f"Vehicle2{sensor}.txt").transform()


@dataclass(frozen=True)
class EncoderParameters:
    """What one count of the wheel encoders means."""

    counts_per_turn: float
    left_diameter_m: float
    right_diameter_m: float


def read_encoder_parameters(path: Path) -> EncoderParameters:
    """calibration/EncoderParameter.txt. The distance between the wheels is not needed."""
    file = CalibrationFile(path)
    values = []
    for key in ("resolution", "left wheel diameter", "right wheel diameter"):
        value = float(file.matrix(f"Encoder {key}", 1)[0])
        if value <= 0.0:
            raise DriveImportError(f"{path}: Encoder {key}: not positive: {value}")
        values.append(value)
    return EncoderParameters(*values)


@dataclass(frozen=True)
class Intrinsics:
    """A camera of ROS's camera_info YAML, as it is (not rectified)."""

    width_px: int
    height_px: int
    K: Matrix
    radtan: list[float]  # k1 k2 p1 p2 [k3]


def read_camera(path: Path) -> Intrinsics:
    """calibration/left.yaml: size, camera_matrix, distortion_coefficients."""
    try:
        text = path.read_text(encoding="utf-8")
        # OpenCV writes a directive and tags that YAML itself does not know.
        content = yaml.safe_load(re.sub(r"^%YAML.*$|!!opencv-matrix", "", text, flags=re.M))
    except OSError as error:
        raise DriveImportError(f"{path}: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise DriveImportError(f"{path}: {error}") from error
    try:
        model = content.get("distortion_model", RADTAN_NAMES[0])
        width, height = int(content["image_width"]), int(content["image_height"])
        K = np.array([float(v) for v in content["camera_matrix"]["data"]]).reshape(3, 3)
        radtan = [float(v) for v in content["distortion_coefficients"]["data"]]
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise DriveImportError(
            f"{path}: not a camera calibration: {type(error).__name__}: {error}"
        ) from error
    if model not in RADTAN_NAMES or len(radtan) not in (4, 5):
        raise DriveImportError(
            f"{path}: expected 4 or 5 coefficients of {RADTAN_NAMES[0]},"
            f" found {len(radtan)} of {model}"
        )
    if width <= 0 or height <= 0 or not np.isfinite(K).all() or not np.isfinite(radtan).all():
        raise DriveImportError(f"{path}: image size or numbers out of range")
    if K[0, 0] <= 0 or K[1, 1] <= 0:
        raise DriveImportError(f"{path}: focal length is not positive")
    return Intrinsics(width, height, K, radtan)

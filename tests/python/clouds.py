# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Clouds for tests: read from LAZ by LASzip, written as PLY."""

from __future__ import annotations

import ctypes
import struct
from pathlib import Path

import numpy as np
import numpy.typing as npt

ROOT = Path(__file__).resolve().parents[2]
Points = npt.NDArray[np.float32]  # rows of x, y, z, intensity


def library() -> ctypes.CDLL:
    """Of third_party/fetch, or the system's where nothing was fetched."""
    fetched = ROOT / "third_party/cache/laszip/lib/liblaszip.so.8"
    return ctypes.CDLL(str(fetched) if fetched.exists() else "liblaszip.so.8")


def read_laz(path: Path, share: float = 1.0) -> Points:
    """The first of its points, that share of all."""
    las = library()
    handle, compressed, point = ctypes.c_void_p(), ctypes.c_int(), ctypes.c_void_p()
    assert las.laszip_create(ctypes.byref(handle)) == 0
    opened = las.laszip_open_reader(handle, str(path).encode(), ctypes.byref(compressed))
    assert opened == 0, f"{path}: not LAS"
    assert las.laszip_get_point_pointer(handle, ctypes.byref(point)) == 0
    with path.open("rb") as file:
        header = file.read(375)
    assert header[24:26] == b"\x01\x04", f"{path}: not LAS 1.4"
    (count,) = struct.unpack_from("<Q", header, 247)
    scales_offsets = np.array(struct.unpack_from("<6d", header, 131)).reshape(2, 3)
    raw = np.empty(int(share * count), [("xyz", "<i4", 3), ("intensity", "<u2")])
    read, copy, size = las.laszip_read_point, ctypes.memmove, raw.itemsize
    for to in range(raw.ctypes.data, raw.ctypes.data + raw.nbytes, size):
        assert read(handle) == 0, f"{path}: cut short"
        copy(to, point, size)
    las.laszip_close_reader(handle)
    las.laszip_destroy(handle)
    positions = raw["xyz"] * scales_offsets[0] + scales_offsets[1]
    return np.column_stack([positions, raw["intensity"]]).astype(np.float32)


def write_ply(path: Path, points: Points) -> Path:
    """Without intensity where the points have but three columns."""
    names = ["x", "y", "z", "intensity"][: points.shape[1]]
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property float {name}\n" for name in names) + "end_header\n"
    path.write_bytes(head.encode() + np.ascontiguousarray(points, "<f4").tobytes())
    return path

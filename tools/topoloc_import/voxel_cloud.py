# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""A PLY point cloud written as the points come, one point per voxel, in bounded memory."""

from __future__ import annotations

import shutil
from collections import OrderedDict
from pathlib import Path
from types import TracebackType

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Keys = npt.NDArray[np.int64]

# Coordinates are relative to the first pose: float32 holds 0.1 mm up to 1 km away.
POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4")])
TILE_M = 50.0
TILES_IN_MEMORY = 64  # what a scanner sees 80 m around takes 16 to 25
Z_BITS = 21
HEADER_BYTES = 512


class VoxelCloud:
    """Keeps the first point of every voxel. Which voxels are taken is remembered in square tiles
    of the ground; tiles that were not used lately wait in a folder beside the cloud, which is gone
    when the cloud is complete."""

    def __init__(
        self, path: Path, voxel_m: float, comment: str, tiles_in_memory: int = TILES_IN_MEMORY
    ) -> None:
        """A voxel of 0 keeps all points. The comment goes into the header."""
        self._path = path
        self._voxel_m = voxel_m
        self._per_tile = max(1, round(TILE_M / voxel_m)) if voxel_m > 0 else 1
        self._comment = comment
        self._tiles_in_memory = tiles_in_memory
        self._tiles: OrderedDict[tuple[int, int], Keys] = OrderedDict()
        self._scratch = path.with_name(path.name + ".tiles")
        self.points = 0

    def __enter__(self) -> VoxelCloud:
        self._scratch.mkdir()
        self._file = self._path.open("wb")
        self._file.write(bytes(HEADER_BYTES))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.seek(0)
        self._file.write(self._header())
        self._file.close()
        shutil.rmtree(self._scratch)

    def add(self, p_world_m: Array, intensity: Array) -> None:
        """Points (n, 3) and intensities (n), of one scan or of several one after the other."""
        if self._voxel_m > 0:
            kept = self._new_voxels(p_world_m)
            p_world_m, intensity = p_world_m[kept], intensity[kept]
        result = np.empty(len(p_world_m), dtype=POINT)
        for axis, name in enumerate("xyz"):
            result[name] = p_world_m[:, axis]
        result["intensity"] = intensity
        self._file.write(result.tobytes())
        self.points += len(result)

    def _new_voxels(self, p_world_m: Array) -> npt.NDArray[np.int64]:
        """Indices, increasing, of the first points in voxels that had none."""
        voxel = np.floor(p_world_m / self._voxel_m).astype(np.int64)
        tile, inside = np.divmod(voxel[:, :2], self._per_tile)
        height = np.clip(voxel[:, 2] + (1 << (Z_BITS - 1)), 0, (1 << Z_BITS) - 1)
        keys = ((inside[:, 0] * self._per_tile + inside[:, 1]) << Z_BITS) + height
        order = np.lexsort((tile[:, 1], tile[:, 0]))  # stable: in a tile first come first
        ends = np.flatnonzero(np.any(np.diff(tile[order], axis=0) != 0, axis=1)) + 1
        kept = []
        for indices in np.split(order, ends):
            if not len(indices):
                continue
            x, y = tile[indices[0]].tolist()
            found, first = np.unique(keys[indices], return_index=True)
            taken = self._tile((x, y))
            place = np.minimum(np.searchsorted(taken, found), len(taken) - 1)
            new = taken[place] != found if len(taken) else np.ones(len(found), dtype=bool)
            kept.append(indices[first[new]])
            self._tiles[x, y] = np.sort(np.concatenate([taken, found[new]]))
        return np.sort(np.concatenate(kept)) if kept else np.empty(0, np.int64)

    def _tile(self, tile: tuple[int, int]) -> Keys:
        """The taken voxels of a tile, which becomes the last used."""
        if tile not in self._tiles:
            file = self._tile_file(tile)
            self._tiles[tile] = np.load(file) if file.exists() else np.empty(0, np.int64)
            if len(self._tiles) > self._tiles_in_memory:
                old, keys = self._tiles.popitem(last=False)
                np.save(self._tile_file(old), keys)
        self._tiles.move_to_end(tile)
        return self._tiles[tile]

    def _tile_file(self, tile: tuple[int, int]) -> Path:
        return self._scratch / f"{tile[0]}_{tile[1]}.npy"

    def _header(self) -> bytes:
        """Of fixed length: the comment takes up what the count of the points leaves."""
        start = f"ply\nformat binary_little_endian 1.0\ncomment {self._comment}"
        end = f"\nelement vertex {self.points}\n"
        end += "".join(f"property float {name}\n" for name in POINT.names or ())
        end += "end_header\n"
        text = start + " " * (HEADER_BYTES - len(start) - len(end)) + end
        assert len(text) == HEADER_BYTES
        return text.encode("ascii")

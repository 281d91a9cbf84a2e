# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""topoloc-evaluate agrees with evo, which everybody knows, where both compute the same figure."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

metrics = pytest.importorskip("evo.core.metrics")
sync = pytest.importorskip("evo.core.sync")
file_interface = pytest.importorskip("evo.tools.file_interface")

ROOT = Path(__file__).resolve().parents[2]
EVALUATE = Path(os.environ.get("TOPOLOC_BIN", ROOT / "build/release/bin")) / "topoloc-evaluate"

Array = NDArray[np.float64]


def multiply(a: Array, b: Array) -> Array:
    """Hamilton product of two quaternions x y z w."""
    vector = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])
    return np.append(vector, a[3] * b[3] - a[:3] @ b[:3])


def write_trajectories(folder: Path) -> tuple[Path, Path]:
    """A winding reference, and an estimate with random errors at its stamps."""
    random = np.random.default_rng(3)
    reference, estimate = folder / "reference.tum", folder / "estimate.tum"
    with reference.open("w") as true_file, estimate.open("w") as estimate_file:
        for i in range(300):
            yaw, time = 0.05 * i, f"13170459{i // 10:02d}.{i % 10}"
            position = np.array([30.0 * np.sin(0.03 * i), 0.7 * i, 0.01 * i])
            rotation = np.array([0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)])
            theta = random.normal(scale=0.02, size=3)
            wrong = multiply(rotation, np.append(theta / 2, 1.0))
            wrong /= np.linalg.norm(wrong)
            moved = position + random.normal(scale=0.3, size=3) + [1.0, 0.0, 0.0]
            print(time, *position, *rotation, file=true_file)
            print(time, *moved, *wrong, file=estimate_file)
    return reference, estimate


@pytest.mark.skipif(not EVALUATE.exists(), reason=f"{EVALUATE} is not built")
def test_ape_equals_evo_without_alignment(tmp_path: Path) -> None:
    reference_path, estimate_path = write_trajectories(tmp_path)
    command: list[str | Path] = [
        EVALUATE,
        "--reference",
        reference_path,
        "--estimate",
        estimate_path,
        "--json",
        "-",
    ]
    ours = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)

    reference, estimate = sync.associate_trajectories(
        file_interface.read_tum_trajectory_file(str(reference_path)),
        file_interface.read_tum_trajectory_file(str(estimate_path)),
    )
    for relation, prefix, mean in (
        (metrics.PoseRelation.translation_part, "position_m", "apet_m"),
        (metrics.PoseRelation.rotation_angle_rad, "rotation_rad", "aper_rad"),
    ):
        ape = metrics.APE(relation)
        ape.process_data((reference, estimate))
        theirs = ape.get_all_statistics()
        assert theirs["mean"] > 0.01
        assert ours[mean] == pytest.approx(theirs["mean"], abs=1e-7)
        for figure in ("rmse", "median", "max"):
            assert ours[f"{figure}_{prefix}"] == pytest.approx(theirs[figure], abs=1e-7)

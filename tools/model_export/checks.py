# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""What an exported file must do: the same as torch, the same as the wheel."""

from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from .lightglue_graph import FILTER_THRESHOLD

# torch and ONNX Runtime sum in different order; features of almost equal score may swap places.
MAX_SCORE_DIFFERENCE = 1e-3
MAX_KEYPOINT_DIFFERENCE_PX = 0.02
MIN_DESCRIPTOR_COSINE = 0.999
MIN_AGREEMENT = 0.98

Arrays = list[NDArray[Any]]


class ExportError(ValueError):
    """An exported file does not do what torch does."""


def session(file: Path) -> onnxruntime.InferenceSession:
    return onnxruntime.InferenceSession(str(file), providers=["CPUExecutionProvider"])


def _require(ok: bool, file: Path, what: str) -> None:
    print(f"  {file.name}: {what}{'' if ok else '  <-- FAILED'}")
    if not ok:
        raise ExportError(f"{file.name}: {what}")


def _nearest(points: NDArray[Any], others: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """For each point the index of the nearest other and its distance."""
    distance = np.linalg.norm(points[:, None] - others[None, :], axis=2)
    index = distance.argmin(1)
    return index, distance[np.arange(len(points)), index]


def features_as_torch(file: Path, ours: Arrays, expected: Arrays) -> None:
    used = expected[1] > 0
    index, distance = _nearest(expected[0][used], ours[0])
    same = distance < MAX_KEYPOINT_DIFFERENCE_PX
    score = np.abs(ours[1][index] - expected[1][used])[same].max()
    cosine = (ours[2][index] * expected[2][used]).sum(1)[same].min()
    ok = same.mean() >= MIN_AGREEMENT and score < MAX_SCORE_DIFFERENCE
    _require(
        bool(ok and cosine > MIN_DESCRIPTOR_COSINE),
        file,
        f"{used.sum()} features, {same.mean():.1%} as torch: keypoints within"
        f" {distance[same].max():.1e} px, scores {score:.1e}, cosine {cosine:.6f}",
    )


def features_as_wheel(
    file: Path,
    ours: Arrays,
    wheel: tuple[NDArray[Any], NDArray[Any] | None],
    tolerance_px: float,
) -> None:
    used = ours[1] > 0
    index, distance = _nearest(wheel[0], ours[0][used])
    same = distance < tolerance_px
    what = f"{same.mean():.1%} of the wheel's keypoints"
    ok = same.mean() >= MIN_AGREEMENT
    if wheel[1] is not None:
        cosine = (wheel[1] * ours[2][used][index]).sum(1)[same]
        what += f", {(cosine > MIN_DESCRIPTOR_COSINE).mean():.1%} of their descriptors"
        ok = ok and (cosine > MIN_DESCRIPTOR_COSINE).mean() >= MIN_AGREEMENT
    _require(bool(ok), file, what)


def repeatability(
    file: Path, first: NDArray[Any], second: NDArray[Any], homography: NDArray[np.float64]
) -> None:
    """Sub-pixel positions must agree better over a known warp than whole pixels do.

    `first`, `second`: keypoints [N,2] of an image and of the image warped by `homography`.
    """

    def error_px(a: NDArray[Any], b: NDArray[Any]) -> float:
        moved = np.c_[a, np.ones(len(a))] @ homography.T
        _, distance = _nearest(moved[:, :2] / moved[:, 2:], b)
        return float(np.median(distance[distance < 1.5]))

    refined, whole = error_px(first, second), error_px(first.round(), second.round())
    _require(
        refined < 0.9 * whole,
        file,
        f"repeatability {refined:.2f} px, of whole pixels {whole:.2f} px",
    )


def matches_as(whose: str, file: Path, ours: Arrays, expected: Arrays) -> None:
    mine, theirs = (np.where(s > FILTER_THRESHOLD, m, -1) for m, s in (ours, expected))
    either = (mine >= 0) | (theirs >= 0)
    agreement = (mine == theirs)[either].mean() if either.any() else 0.0
    score = np.abs(ours[1] - expected[1])[mine == theirs].max()
    _require(
        bool(agreement >= MIN_AGREEMENT and score < 10 * MAX_SCORE_DIFFERENCE),
        file,
        f"{(theirs >= 0).sum()} matches, {agreement:.1%} as {whose}, scores within {score:.1e}",
    )

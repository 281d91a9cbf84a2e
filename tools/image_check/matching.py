# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""XFeat and LighterGlue as the localiser runs them; tests of matches by two views' geometry."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import onnxruntime
from scipy.spatial.transform import Rotation

from image_check.frames import FOCAL_PX, HEIGHT_PX, WIDTH_PX, Floats, Frame, Grey

FEATURES = 512
MIN_SIMILARITY = 0.82  # matching.min_similarity
MIN_SCORE = 0.1  # matching.min_match_score
INLIER_PX = 2.0
RANSAC_ROUNDS = 400

Pairs = npt.NDArray[np.int64]  # n x 2: feature of the first, of the second image


@dataclass(frozen=True)
class Features:
    pixels: Floats
    descriptors: npt.NDArray[np.float32]

    @property
    def rays(self) -> Floats:
        """x, y, 1 of the pinhole camera."""
        centre = np.array([0.5 * (WIDTH_PX - 1), 0.5 * (HEIGHT_PX - 1)])
        return np.column_stack([(self.pixels - centre) / FOCAL_PX, np.ones(len(self.pixels))])


def session(path: Path) -> onnxruntime.InferenceSession:
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    options = onnxruntime.SessionOptions()
    options.add_session_config_entry("session.set_denormal_as_zero", "1")
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


class Models:
    def __init__(self, folder: Path) -> None:
        size = f"{WIDTH_PX}x{HEIGHT_PX}_n{FEATURES}"
        self.extractor = session(folder / f"xfeat_{size}.onnx")
        self.matcher = session(folder / f"lighterglue_n{FEATURES}.onnx")

    def extract(self, image: Grey, mask: npt.NDArray[np.bool_]) -> Features:
        inputs = {"image": image[None, None], "mask": mask[None, None].astype(np.float32)}
        names = ["keypoints", "scores", "descriptors"]
        keypoints, scores, descriptors = self.extractor.run(names, inputs)
        used = (scores > 0) & np.isfinite(descriptors[:, 0])
        return Features(keypoints[used].astype(np.float64), descriptors[used])

    def network(self, a: Features, b: Features) -> Pairs:
        inputs: dict[str, npt.NDArray[np.float32]] = {}
        for side, features in enumerate((a, b)):
            count = len(features.pixels)
            keypoints = np.zeros((FEATURES, 2), np.float32)
            keypoints[:count] = features.pixels
            descriptors = np.zeros((FEATURES, features.descriptors.shape[1]), np.float32)
            descriptors[:count] = features.descriptors
            valid = np.zeros(FEATURES, np.float32)
            valid[:count] = 1.0
            inputs |= {
                f"keypoints{side}": keypoints,
                f"descriptors{side}": descriptors,
                f"valid{side}": valid,
                f"size{side}": np.array([WIDTH_PX, HEIGHT_PX], np.float32),
            }
        matches, scores = self.matcher.run(["matches0", "scores0"], inputs)
        good = (matches >= 0) & (matches < len(b.pixels)) & (scores >= MIN_SCORE)
        good[len(a.pixels) :] = False
        return np.column_stack([np.flatnonzero(good), matches[good]]).astype(np.int64)


def mutual(a: Features, b: Features) -> Pairs:
    if not len(a.pixels) or not len(b.pixels):
        return np.zeros((0, 2), np.int64)
    similarity = a.descriptors @ b.descriptors.T
    forth, back = similarity.argmax(1), similarity.argmax(0)
    first = np.arange(len(forth))
    good = (back[forth] == first) & (similarity[first, forth] >= MIN_SIMILARITY)
    return np.column_stack([first[good], forth[good]]).astype(np.int64)


def epipolar_px(essential: Floats, rays_a: Floats, rays_b: Floats) -> Floats:
    """The larger of the distances to the two epipolar lines."""
    line_b, line_a = rays_a @ essential.T, rays_b @ essential
    product = np.abs((rays_b * line_b).sum(1))
    length = np.minimum(np.hypot(*line_a[:, :2].T), np.hypot(*line_b[:, :2].T))
    out: Floats = FOCAL_PX * product / np.maximum(length, 1e-12)
    return out


def skew(t: Floats) -> Floats:
    out: Floats = np.array([[0.0, -t[2], t[1]], [t[2], 0.0, -t[0]], [-t[1], t[0], 0.0]])
    return out


def true_agreement(a: Frame, b: Frame, rays_a: Floats, rays_b: Floats) -> npt.NDArray[np.bool_]:
    """Which matches agree with the true poses, whatever the depth."""
    R = (b.rotation.inv() * a.rotation).as_matrix()  # b from a
    t = b.rotation.inv().apply(a.position_m - b.position_m)
    if np.linalg.norm(t) < 0.02:
        turned = rays_a @ R.T
        shift = turned[:, :2] / turned[:, 2:] - rays_b[:, :2]
        return np.asarray(FOCAL_PX * np.hypot(*shift.T) <= INLIER_PX)
    return np.asarray(epipolar_px(skew(t) @ R, rays_a, rays_b) <= INLIER_PX)


def eight_points(rays_a: Floats, rays_b: Floats) -> Floats:
    rows = (rays_b[:, :, None] * rays_a[:, None, :]).reshape(len(rays_a), 9)
    essential = np.linalg.svd(rows)[2][-1].reshape(3, 3)
    u, _, v = np.linalg.svd(essential)
    out: Floats = u @ np.diag([1.0, 1.0, 0.0]) @ v
    return out


def found_agreement(rays_a: Floats, rays_b: Floats, seed: int) -> npt.NDArray[np.bool_]:
    """Which matches agree with the essential matrix that most of them agree with."""
    best = np.zeros(len(rays_a), bool)
    if len(rays_a) < 16:
        return best
    random = np.random.default_rng(seed)
    for _ in range(RANSAC_ROUNDS):
        chosen = random.choice(len(rays_a), 8, replace=False)
        essential = eight_points(rays_a[chosen], rays_b[chosen])
        agree = epipolar_px(essential, rays_a, rays_b) <= INLIER_PX
        if agree.sum() > best.sum():
            best = agree
    for _ in range(3):
        essential = eight_points(rays_a[best], rays_b[best])
        agree = epipolar_px(essential, rays_a, rays_b) <= INLIER_PX
        if agree.sum() <= best.sum():
            break
        best = agree
    return best


def heading_angle(a: Rotation, b: Rotation) -> float:
    """Between two cameras' optical axes [rad]."""
    axis = np.array([0.0, 0.0, 1.0])
    return float(np.arccos(np.clip(a.apply(axis) @ b.apply(axis), -1.0, 1.0)))

# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Behaviour of the exported models that the C++ side relies on."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
import pytest
from numpy.typing import NDArray

from model_export.catalogue import matcher_of
from model_export.test_images import as_tensor, drawn_scene

Features = dict[str, NDArray[np.float32]]


@dataclass
class Pair:
    """An extractor and the matcher trained with it."""

    extractor: Any
    matcher: Any
    width_px: int
    height_px: int
    count: int
    scene: NDArray[np.float32]

    def extract(self, image: NDArray[np.float32], mask: NDArray[np.float32]) -> Features:
        names = ["keypoints", "scores", "descriptors"]
        outputs = self.extractor.run(names, {"image": image, "mask": mask})
        return dict(zip(names, outputs, strict=True))

    def side(self, features: Features, valid: NDArray[np.bool_], number: int) -> Features:
        return {
            f"keypoints{number}": features["keypoints"],
            f"size{number}": np.array([self.width_px, self.height_px], np.float32),
            f"descriptors{number}": features["descriptors"],
            f"valid{number}": valid.astype(np.float32),
        }


@pytest.fixture(scope="module", params=["xfeat", "aliked-n16", "disk"])
def pair(request: pytest.FixtureRequest, models: Path, small_models: Callable[[], Path]) -> Pair:
    name = request.param
    # The other models only small: they are slow.
    width_px, height_px, count = (640, 384, 512) if name == "xfeat" else (320, 192, 256)
    folder = models if name == "xfeat" else small_models()
    extractor = onnxruntime.InferenceSession(
        str(folder / f"{name}_{width_px}x{height_px}_n{count}.onnx")
    )
    matcher = onnxruntime.InferenceSession(str(folder / f"{matcher_of(name)}_n{count}.onnx"))
    scene = as_tensor(drawn_scene(width_px, height_px))
    return Pair(extractor, matcher, width_px, height_px, count, scene)


@pytest.mark.parametrize("small", [False, True])
def test_index_describes_every_file(
    models: Path, small_models: Callable[[], Path], small: bool
) -> None:
    folder = small_models() if small else models
    listed = json.loads((folder / "models.json").read_text())["models"]
    assert {m["file"] for m in listed} == {p.name for p in folder.glob("*.onnx")}
    for model in listed:
        session = onnxruntime.InferenceSession(str(folder / model["file"]))
        assert [i.name for i in session.get_inputs()] == model["inputs"]
        assert [o.name for o in session.get_outputs()] == model["outputs"]
        assert session.get_outputs()[0].shape[0] == model["max_features"]


def test_features_stay_out_of_the_mask(pair: Pair) -> None:
    mask = np.ones_like(pair.scene)
    edge = pair.height_px // 2
    mask[..., edge:, :] = 0.0
    features = pair.extract(pair.scene, mask)
    used = features["scores"] > 0
    assert used.sum() > 50
    # Refinement may cross the edge, by half a pixel or, in ALIKED's window, by two.
    assert features["keypoints"][used, 1].max() <= edge + 1.0
    assert np.all(np.diff(features["scores"]) <= 0)
    assert features["scores"].max() <= 1.0
    np.testing.assert_allclose(np.linalg.norm(features["descriptors"], axis=1), 1.0, atol=1e-5)


def test_blank_image_has_hardly_a_feature_and_no_nan(pair: Pair) -> None:
    blank = np.full_like(pair.scene, 128.0)
    features = pair.extract(blank, np.ones_like(blank))
    assert np.count_nonzero(features["scores"] > 0) <= 5
    assert all(np.isfinite(v).all() for v in features.values())


def test_image_matches_itself_and_empty_slots_never_match(pair: Pair) -> None:
    features = pair.extract(pair.scene, np.ones_like(pair.scene))
    slots = np.arange(pair.count)
    every = features["scores"] > 0
    some = every & (slots % 3 > 0)
    matches, scores = pair.matcher.run(
        None, pair.side(features, every, 0) | pair.side(features, every, 1)
    )
    assert (matches == slots)[every].mean() > 0.95
    matches, scores = pair.matcher.run(
        None, pair.side(features, some, 0) | pair.side(features, every, 1)
    )
    assert np.all(matches[~some] == -1) and np.all(scores[~some] == 0)
    assert (matches == slots)[some].mean() > 0.95
    nothing = np.zeros(pair.count, bool)
    matches, scores = pair.matcher.run(
        None, pair.side(features, every, 0) | pair.side(features, nothing, 1)
    )
    assert np.all(matches == -1) and np.all(scores == 0)

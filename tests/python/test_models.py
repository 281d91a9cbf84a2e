# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Behaviour of the exported models that the C++ side relies on."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
import pytest
from numpy.typing import NDArray

from model_export.test_images import as_tensor, drawn_scene

ROOT = Path(__file__).resolve().parents[2]
MODELS = Path(os.environ.get("TOPOLOC_MODELS", ROOT / "third_party/cache/models"))
WIDTH_PX, HEIGHT_PX, COUNT = 640, 384, 512

Features = dict[str, NDArray[np.float32]]


@pytest.fixture(scope="module")
def extractor() -> Any:
    return onnxruntime.InferenceSession(str(MODELS / "xfeat_640x384_n512.onnx"))


@pytest.fixture(scope="module")
def matcher() -> Any:
    return onnxruntime.InferenceSession(str(MODELS / "lighterglue_n512.onnx"))


def extract(session: Any, image: NDArray[np.float32], mask: NDArray[np.float32]) -> Features:
    names = ["keypoints", "scores", "descriptors"]
    return dict(zip(names, session.run(names, {"image": image, "mask": mask}), strict=True))


def side(features: Features, valid: NDArray[np.bool_], number: int) -> Features:
    return {
        f"keypoints{number}": features["keypoints"],
        f"size{number}": np.array([WIDTH_PX, HEIGHT_PX], np.float32),
        f"descriptors{number}": features["descriptors"],
        f"valid{number}": valid.astype(np.float32),
    }


@pytest.fixture(scope="module")
def scene() -> NDArray[np.float32]:
    return as_tensor(drawn_scene(WIDTH_PX, HEIGHT_PX))


def test_index_describes_every_file() -> None:
    listed = json.loads((MODELS / "models.json").read_text())["models"]
    assert {m["file"] for m in listed} == {p.name for p in MODELS.glob("*.onnx")}
    for model in listed:
        session = onnxruntime.InferenceSession(str(MODELS / model["file"]))
        assert [i.name for i in session.get_inputs()] == model["inputs"]
        assert [o.name for o in session.get_outputs()] == model["outputs"]
        assert session.get_outputs()[0].shape[0] == model["max_features"]


def test_features_stay_out_of_the_mask(extractor: Any, scene: NDArray[np.float32]) -> None:
    mask = np.ones_like(scene)
    mask[..., 200:, :] = 0.0
    features = extract(extractor, scene, mask)
    used = features["scores"] > 0
    assert used.sum() > 200
    assert features["keypoints"][used, 1].max() <= 199.5  # refinement moves half a pixel at most
    assert np.all(np.diff(features["scores"]) <= 0)
    np.testing.assert_allclose(np.linalg.norm(features["descriptors"], axis=1), 1.0, atol=1e-5)


def test_blank_image_has_no_features_and_no_nan(extractor: Any) -> None:
    blank = np.full((1, 1, HEIGHT_PX, WIDTH_PX), 128.0, np.float32)
    features = extract(extractor, blank, np.ones_like(blank))
    assert np.count_nonzero(features["scores"] > 0) == 0
    assert all(np.isfinite(v).all() for v in features.values())


def test_image_matches_itself_and_empty_slots_never_match(
    extractor: Any, matcher: Any, scene: NDArray[np.float32]
) -> None:
    features = extract(extractor, scene, np.ones_like(scene))
    every, some = np.ones(COUNT, bool), np.arange(COUNT) % 3 > 0
    matches, scores = matcher.run(None, side(features, every, 0) | side(features, every, 1))
    assert (matches == np.arange(COUNT)).mean() > 0.95
    matches, scores = matcher.run(None, side(features, some, 0) | side(features, every, 1))
    assert np.all(matches[~some] == -1) and np.all(scores[~some] == 0)
    assert (matches[some] == np.arange(COUNT)[some]).mean() > 0.95
    nothing = np.zeros(COUNT, bool)
    matches, scores = matcher.run(None, side(features, every, 0) | side(features, nothing, 1))
    assert np.all(matches == -1) and np.all(scores == 0)

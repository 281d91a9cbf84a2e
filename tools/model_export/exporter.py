# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Writes the ONNX files and holds each against torch and against the wheel's own code."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from . import checks
from .lightglue_graph import FILTER_THRESHOLD
from .networks import MatcherNetwork, extractor_network, matcher_network
from .test_images import as_tensor, drawn_scene, photo, warped

OPSET = 17
# A plausible step between two frames: turn, zoom, some perspective.
STEP = np.array([[1.03, 0.02, -14.0], [-0.015, 1.02, 3.0], [2e-5, 1e-5, 1.0]])
MATCHED_SIZE_PX = (640, 384)


class Exporter:
    """Exports into one folder, checking on a drawn scene and, if given, on a photograph."""

    def __init__(self, models_dir: Path, photo_path: Path | None) -> None:
        self.models_dir = models_dir
        self.photo_path = photo_path

    def _images(self, width_px: int, height_px: int) -> list[NDArray[np.float32]]:
        """Pairs of views, one after the other."""
        scenes = [drawn_scene(width_px, height_px)]
        if self.photo_path is not None:
            scenes.append(photo(self.photo_path, width_px, height_px))
        return [as_tensor(view) for scene in scenes for view in (scene, warped(scene, STEP))]

    def _write(
        self,
        graph: torch.nn.Module,
        example: tuple[Tensor, ...],
        file: Path,
        inputs: list[str],
        outputs: list[str],
    ) -> None:
        with tempfile.TemporaryDirectory(dir=self.models_dir) as folder:
            temporary = Path(folder) / file.name
            torch.onnx.export(
                graph,
                example,
                str(temporary),
                opset_version=OPSET,
                input_names=inputs,
                output_names=outputs,
            )
            temporary.rename(file)

    @torch.no_grad()
    def export_extractor(
        self, name: str, file_name: str, width_px: int, height_px: int, count: int
    ) -> dict[str, Any]:
        """Writes an extractor of catalogue.EXTRACTORS; returns its entry of models.json."""
        file = self.models_dir / file_name
        network = extractor_network(name)
        graph = network.graph(width_px, height_px, count)
        images = self._images(width_px, height_px)
        everywhere = np.ones((1, 1, height_px, width_px), np.float32)
        mask = everywhere.copy()
        mask[..., height_px * 5 // 6 :, :] = 0.0  # as a bonnet would be
        example = (torch.from_numpy(images[0]), torch.from_numpy(mask))
        inputs, outputs = ["image", "mask"], ["keypoints", "scores", "descriptors"]
        self._write(graph, example, file, inputs, outputs)

        session = checks.session(file)
        unmasked = []
        for image in images:
            ours = session.run(None, {"image": image, "mask": mask})
            expected = [t.numpy() for t in graph(torch.from_numpy(image), example[1])]
            checks.features_as_torch(file, ours, expected)
            unmasked.append(session.run(None, {"image": image, "mask": everywhere}))
            wheel = network.wheel_features(image, count)
            checks.features_as_wheel(file, unmasked[-1], wheel, network.keypoint_tolerance_px)
        for first, second in zip(unmasked[::2], unmasked[1::2], strict=True):
            checks.repeatability(file, first[0], second[0], STEP)
        return {
            "file": file.name,
            "kind": "extractor",
            "name": name,
            "inputs": inputs,
            "outputs": outputs,
            "width_px": width_px,
            "height_px": height_px,
            "max_features": count,
            "descriptor_dim": expected[2].shape[1],
        }

    @torch.no_grad()
    def export_matcher(self, name: str, file_name: str, count: int) -> dict[str, Any]:
        """Writes a matcher of catalogue.MATCHERS; returns its entry of models.json."""
        file = self.models_dir / file_name
        network = matcher_network(name)
        graph = network.graph(count)
        images = self._images(*MATCHED_SIZE_PX)
        extractor = network.extractor.graph(*MATCHED_SIZE_PX, count)
        views = [extractor(torch.from_numpy(i), torch.ones(i.shape)) for i in images]
        size = torch.tensor(MATCHED_SIZE_PX, dtype=torch.float32)
        inputs = [
            f"{name}{side}"
            for side in (0, 1)
            for name in ("keypoints", "size", "descriptors", "valid")
        ]
        outputs = ["matches0", "scores0"]

        written = False
        for first, second in zip(views[::2], views[1::2], strict=True):
            # Leave the last eighth of the first set empty, so that masking is checked too.
            valid0 = (torch.arange(count) < count * 7 // 8).float() * (first[1] > 0)
            valid1 = (second[1] > 0).float()
            feed = (first[0], size, first[2], valid0, second[0], size, second[2], valid1)
            if not written:
                self._write(graph, feed, file, inputs, outputs)
                session, written = checks.session(file), True
            ours = session.run(None, {n: t.numpy() for n, t in zip(inputs, feed, strict=True)})
            checks.matches_as("torch", file, ours, [t.numpy() for t in graph(*feed)])
            checks.matches_as("the wheel", file, ours, self._wheel_matches(network, feed))
        return {
            "file": file.name,
            "kind": "matcher",
            "name": name,
            "inputs": inputs,
            "outputs": outputs,
            "max_features": count,
            "descriptor_dim": graph.dim.descriptor,
            "score_threshold": FILTER_THRESHOLD,
        }

    @staticmethod
    def _wheel_matches(network: MatcherNetwork, feed: tuple[Tensor, ...]) -> checks.Arrays:
        def side(keypoints: Tensor, size: Tensor, descriptors: Tensor, valid: Tensor) -> Any:
            used = int(valid.sum())  # the first ones
            return {
                "keypoints": keypoints[None, :used],
                "descriptors": descriptors[None, :used],
                "image_size": size[None],
            }

        found = network.wheel_matches(side(*feed[:4]), side(*feed[4:]))
        matches, scores = np.full(len(feed[0]), -1), np.zeros(len(feed[0]))
        for padded, values in zip((matches, scores), found, strict=True):
            padded[: len(values)] = values.numpy()
        return [matches, scores]

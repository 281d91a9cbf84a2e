#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""Makes small detector-free matchers for the C++ tests: pair_models.py FOLDER.

A block matcher really matches: patches on a grid over image 0 are searched in all of image 1 by
zero-normalised cross-correlation. The others each break one rule of docs/models.md.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

PATCH_PX = 9
GRID_PX = 8  # from one patch of image 0 to the next
WIDTH_PX, HEIGHT_PX = 96, 64
FLAT = 1e-3  # added to the norm of a patch: keeps a flat one from matching everything

Side = int | str


@dataclass
class Graph:
    """Nodes and constants under construction."""

    nodes: list[onnx.NodeProto]
    constants: list[onnx.TensorProto]

    def constant(self, name: str, value: NDArray[np.generic]) -> str:
        self.constants.append(numpy_helper.from_array(value, name))
        return name

    def add(self, operator: str, inputs: list[str], output: str, **attributes: Any) -> str:
        self.nodes.append(helper.make_node(operator, inputs, [output], **attributes))
        return output

    def patches(self, image: str, stride: int) -> tuple[str, str]:
        """Every `stride` pixels: patches [P, PATCH_PX^2] of zero mean and unit length, and the
        place in pixels of their centres [P,2]."""
        n = f"{image}_"
        grid = self.add("Conv", [image, "cut"], n + "grid", strides=[stride, stride])
        flat = self.add("Reshape", [grid, "columns"], n + "flat")
        rows = self.add("Transpose", [flat], n + "rows", perm=[1, 0])
        mean = self.add("ReduceMean", [rows], n + "mean", axes=[1])
        centred = self.add("Sub", [rows, mean], n + "centred")
        norm = self.add("ReduceL2", [centred], n + "norm", axes=[1])
        length = self.add("Add", [norm, "flat"], n + "length")
        unit = self.add("Div", [centred, length], n + "unit")
        # Row and column of every place of the grid, in the same order.
        sides = self.add("Shape", [grid], n + "sides", start=2)
        ones = self.add("ConstantOfShape", [sides], n + "ones", value=ONE)
        places = self.add("NonZero", [ones], n + "places")
        real = self.add("Cast", [places], n + "real", to=TensorProto.FLOAT)
        step = self.constant(n + "step", np.array(stride, np.float32))
        corner = self.add("Mul", [real, step], n + "corner")
        centre = self.add("Add", [corner, "half"], n + "centre")
        yx = self.add("Transpose", [centre], n + "yx", perm=[1, 0])
        return unit, self.add("Gather", [yx, "swap"], n + "xy", axis=1)


ONE = helper.make_tensor("one", TensorProto.FLOAT, [1], [1.0])


def block_matcher(
    width: Side = WIDTH_PX,
    height: Side = HEIGHT_PX,
    *,
    only_sure: bool = False,
    names: tuple[str, str, str] = ("keypoints0", "keypoints1", "confidence"),
    channels: int = 1,
    extra_input: str | None = None,
) -> onnx.ModelProto:
    """Sides may be names: then the file leaves them open. `only_sure`: as many matches as have a
    correlation above 0.9, else one for every patch."""
    g = Graph([], [])
    pixels = PATCH_PX * PATCH_PX
    cut = np.eye(pixels, dtype=np.float32).reshape(pixels, 1, PATCH_PX, PATCH_PX)
    g.constant("cut", np.repeat(cut, channels, 1))
    g.constant("columns", np.array([pixels, -1], np.int64))
    g.constant("flat", np.array(FLAT, np.float32))
    g.constant("half", np.array(PATCH_PX // 2, np.float32))
    g.constant("swap", np.array([1, 0], np.int64))
    patches0, places0 = g.patches("image0", GRID_PX)
    patches1, places1 = g.patches("image1", 1)
    columns = g.add("Transpose", [patches1], "columns1", perm=[1, 0])
    correlation = g.add("MatMul", [patches0, columns], "correlation")
    best = g.add("ArgMax", [correlation], "best", axis=1, keepdims=0)
    found = g.add("Gather", [places1, best], "found", axis=0)
    confidence = g.add("ReduceMax", [correlation], "peak", axes=[1], keepdims=0)
    results = (places0, found, confidence)
    if only_sure:
        threshold = g.constant("sure", np.array(0.9, np.float32))
        sure = g.add("Greater", [confidence, threshold], "is_sure")
        results = tuple(g.add("Compress", [r, sure], f"{r}_sure", axis=0) for r in results)  # type: ignore[assignment]
    for result, name in zip(results, names, strict=True):
        g.add("Identity", [result], name)

    count: Side = "M"
    if not only_sure and isinstance(width, int) and isinstance(height, int):
        count = ((width - PATCH_PX) // GRID_PX + 1) * ((height - PATCH_PX) // GRID_PX + 1)
    shape = [1, channels, height, width]
    inputs = ["image0", "image1"] + ([extra_input] if extra_input else [])
    graph = helper.make_graph(
        g.nodes,
        "block matcher",
        [helper.make_tensor_value_info(i, TensorProto.FLOAT, shape) for i in inputs],
        [
            helper.make_tensor_value_info(n, TensorProto.FLOAT, [count, *columns_of])
            for n, columns_of in zip(names, ([2], [2], []), strict=True)
        ],
        g.constants,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model)
    return model


def masked_mean(keypoints1: int = 1) -> onnx.ModelProto:
    """One match, whose confidence is the mean of mask 0: shows that a mask reaches the network."""
    shape = [1, 1, HEIGHT_PX, WIDTH_PX]
    places = [
        numpy_helper.from_array(np.zeros((rows, 2), np.float32), f"places{i}")
        for i, rows in enumerate((1, keypoints1))
    ]
    graph = helper.make_graph(
        [
            helper.make_node("ReduceMean", ["mask0"], ["mean"], axes=[1, 2, 3], keepdims=0),
            helper.make_node("Identity", ["mean"], ["confidence"]),
            helper.make_node("Identity", ["places0"], ["keypoints0"]),
            helper.make_node("Identity", ["places1"], ["keypoints1"]),
        ],
        "masked mean",
        [
            helper.make_tensor_value_info(n, TensorProto.FLOAT, shape)
            for n in ("image0", "image1", "mask0", "mask1")
        ],
        [
            helper.make_tensor_value_info("keypoints0", TensorProto.FLOAT, [1, 2]),
            helper.make_tensor_value_info("keypoints1", TensorProto.FLOAT, [keypoints1, 2]),
            helper.make_tensor_value_info("confidence", TensorProto.FLOAT, [1]),
        ],
        places,
    )
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)


def main() -> None:
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    models = {
        "block": block_matcher(),
        "block_open": block_matcher("W", "H", only_sure=True),
        "masked_mean": masked_mean(),
        "disagreeing": masked_mean(keypoints1=2),
        "wrong_names": block_matcher(names=("mkpts0_f", "mkpts1_f", "mconf")),
        "colour": block_matcher(channels=3),
        "extra_input": block_matcher(extra_input="scale"),
    }
    for name, model in models.items():
        onnx.save(model, folder / f"{name}.onnx")


if __name__ == "__main__":
    main()

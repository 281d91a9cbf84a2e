// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/patterns.hpp"

#include <array>

namespace topoloc::world::patterns {

using namespace noise;

namespace {

/// A car's paint: what the eye sees and what a LiDAR does need not agree.
struct Paint {
  float albedo;
  float nir;
};
constexpr std::array<Paint, 10> kPaints{{{0.78F, 0.7F},     // white
                                         {0.76F, 0.66F},    // white
                                         {0.48F, 0.42F},    // silver
                                         {0.36F, 0.35F},    // silver grey
                                         {0.2F, 0.2F},      // grey
                                         {0.1F, 0.12F},     // anthracite
                                         {0.025F, 0.04F},   // black: most beams are lost
                                         {0.03F, 0.06F},    // black
                                         {0.08F, 0.3F},     // blue
                                         {0.13F, 0.55F}}};  // red

}  // namespace

// p: 0 body, 1 lamps, 2 sills and bumpers.
Appearance car_body(const Spot& s) {
  const std::uint32_t key = hash(s.instance, 4U, 73U);
  const Paint paint = kPaints[key % kPaints.size()];
  const float dirt = 0.12F * octave(s.u, s.v, 0.12F, s.instance, s.footprint) +
                     0.15F * octave(s.u, s.v, 0.7F, s.instance + 1U, s.footprint);
  if (s.p[0] > 1.5F) {
    const bool painted = unit(again(key)) < 0.55F;
    const float tone = painted ? paint.albedo : 0.05F;
    return {tone * (0.9F + dirt), (painted ? paint.nir : 0.08F) * (0.9F + dirt), 0.0F, 0.0F,
            painted ? 0.15F : 0.04F};
  }
  if (s.p[0] > 0.5F) {
    const float ribs = repeated(s.u, 0.06F, 0.03F, s.footprint);
    return {0.3F + 0.3F * ribs, 0.4F, 0.45F, 0.0F, 0.3F};
  }
  return {paint.albedo * (1.0F + dirt), paint.nir * (1.0F + dirt), 0.0F, 0.0F, 0.25F};
}

Appearance car_glass(const Spot& s) {
  const float inside = 0.045F + 0.05F * octave(s.u, s.v, 0.25F, s.instance + 2U, s.footprint);
  return {inside, 0.03F, 0.0F, 0.0F, 0.35F};
}

// p: 0 rubber, 1 rim.
Appearance tyre(const Spot& s) {
  if (s.p[0] > 0.5F) {
    const float tone = unit(s.instance + 3U) < 0.7F ? 0.45F : 0.12F;
    return {tone, 0.4F, 0.0F, 0.0F, 0.15F};
  }
  const float tread = 0.3F * octave(s.u, s.v, 0.03F, s.seed, s.footprint);
  return {0.035F * (1.0F + tread), 0.05F, 0.0F, 0.0F, 0.0F};
}

}  // namespace topoloc::world::patterns

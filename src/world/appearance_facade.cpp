// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/patterns.hpp"

#include <cmath>

namespace topoloc::world::patterns {

using namespace noise;

namespace {

/// Something made of pieces laid in rows.
struct Laid {
  float joint;  ///< share of the spot
  float tone;   ///< of this piece, about 0
  float nir;
};

Laid rows(const Spot& s, float long_m, float high_m, float joint_m, std::uint32_t salt) {
  const float row = whole(s.v / high_m);
  const float shift = 0.5F * long_m * (row - 2.0F * whole(0.5F * row));
  const float u = s.u + shift;
  const std::uint32_t key = hash(cell(u / long_m), cell(s.v / high_m), s.seed + salt);
  const float share = fade(high_m, s.footprint);
  return {std::min(1.0F, repeated(u, long_m, joint_m, s.footprint) +
                             repeated(s.v, high_m, joint_m, s.footprint)),
          share * (unit(key) - 0.5F), share * (unit(again(key)) - 0.5F)};
}

// Somebody's name in paint, on some walls, at a man's height: seen by a camera only.
float graffiti(const Spot& s) {
  constexpr float kPiece_m = 3.4F;
  const std::uint32_t key = hash(cell(s.u / kPiece_m), 0U, s.seed + 50U);
  if (unit(key) > 0.09F || s.v < 0.35F || s.v > 1.9F || s.p[2] < 0.0F) {
    return 0.0F;
  }
  const float x = s.u - whole(s.u / kPiece_m) * kPiece_m - 0.3F;
  const float slant = 0.25F * (s.v - 0.9F);
  return lettering((x - slant) / 0.9F, (s.v - 0.6F) / 0.9F, s.footprint / 0.9F, again(key), 3);
}

}  // namespace

// p: kind 0 plaster, 1 brick, 2 rough cast, 3 panels, 4 quarry stone; tone; height of the eave.
Appearance facade(const Spot& s) {
  const float tone = s.p[1];
  const int kind = static_cast<int>(s.p[0]);
  const float nir_base = 0.3F + 0.35F * unit(s.seed + 90U);
  const float stains = 0.22F * octave(s.u, s.v, 2.7F, s.seed, s.footprint) +
                       0.2F * octave(s.u, s.v, 0.55F, s.seed + 1U, s.footprint) +
                       0.18F * octave(s.u, s.v * 0.09F, 0.22F, s.seed + 2U, s.footprint);
  const float foot = 0.3F * (1.0F - ramp(s.v, 0.1F, 1.1F)) *
                     (0.7F + octave(s.u, s.v, 0.4F, s.seed + 3U, s.footprint));
  float relief = stains - foot;
  float nir_relief = 0.5F * stains - 0.5F * foot;
  float joint = 0.0F;
  float joint_tone = 0.6F;
  float joint_nir = 0.6F;
  switch (kind) {
    case 1: {
      const Laid brick = rows(s, 0.25F, 0.083F, 0.012F, 10U);
      relief += 0.55F * brick.tone + 0.25F * octave(s.u, s.v, 0.02F, s.seed + 4U, s.footprint);
      nir_relief += 0.3F * brick.nir;
      joint = brick.joint;
      joint_tone = 0.42F / std::max(tone, 0.05F);
      joint_nir = 0.75F;  // mortar: lighter for the camera, darker for the LiDAR
      break;
    }
    case 3: {
      const Laid panel = rows(s, 2.4F, 1.2F, 0.02F, 20U);
      relief += 0.14F * panel.tone;
      nir_relief += 0.2F * panel.nir;
      joint = panel.joint;
      joint_tone = 0.35F;
      break;
    }
    case 4: {
      const Laid stone = rows(s, 0.62F, 0.31F, 0.018F, 30U);
      relief += 0.6F * stone.tone + 0.3F * octave(s.u, s.v, 0.07F, s.seed + 5U, s.footprint);
      nir_relief += 0.45F * stone.nir;
      joint = stone.joint;
      joint_tone = 0.55F;
      break;
    }
    case 2:
      relief += 0.45F * octave(s.u, s.v, 0.025F, s.seed + 6U, s.footprint) +
                0.3F * octave(s.u, s.v, 0.09F, s.seed + 7U, s.footprint);
      break;
    default:
      relief += 0.14F * octave(s.u, s.v, 0.03F, s.seed + 8U, s.footprint);
      // Plaster that came off shows what is below.
      {
        const float off = ramp(0.5F + octave(s.u, s.v, 1.1F, s.seed + 9U, s.footprint) +
                                   0.4F * octave(s.u, s.v, 0.17F, s.seed + 10U, s.footprint),
                               0.93F, 0.96F);
        relief -= 0.4F * off;
        nir_relief -= 0.3F * off;
      }
  }
  float albedo = tone * (1.0F + relief);
  float nir = nir_base * (1.0F + nir_relief);
  albedo = mix(albedo, tone * joint_tone * (1.0F + stains), joint);
  nir = mix(nir, nir_base * joint_nir, joint);
  if (kind != 1 && s.v < 2.0F) {
    const float paint = graffiti(s);
    albedo = mix(albedo, tone > 0.4F ? 0.08F : 0.7F, paint);
  }
  return {albedo, nir, 0.0F, 0.0F, 0.01F};
}

// p: 0 tiles, 1 slate, 2 sheet metal; tone.
Appearance roof(const Spot& s) {
  const float tone = s.p[1];
  const float weather = 0.4F * octave(s.u, s.v, 1.6F, s.seed, s.footprint) +
                        0.3F * octave(s.u, s.v, 0.3F, s.seed + 1U, s.footprint) +
                        0.25F * octave(s.u, s.v, 0.05F, s.seed + 2U, s.footprint);
  const float moss = ramp(0.5F + octave(s.u, s.v, 2.3F, s.seed + 3U, s.footprint) +
                              0.5F * octave(s.u, s.v, 0.25F, s.seed + 4U, s.footprint),
                          0.75F, 0.85F);
  if (s.p[0] > 1.5F) {
    const float seam = repeated(s.u, 0.6F, 0.03F, s.footprint);
    return {tone * 1.4F * (1.0F + 0.6F * weather) * (1.0F + 0.5F * seam),
            0.4F * (1.0F + 0.3F * weather - 0.4F * seam), 0.0F, 0.0F, 0.1F};
  }
  const Laid tile =
      rows(s, s.p[0] < 0.5F ? 0.24F : 0.3F, s.p[0] < 0.5F ? 0.33F : 0.22F, 0.03F, 40U);
  return {
      mix(tone * (1.0F + weather + 0.45F * tile.tone), 0.12F, moss) * (1.0F - 0.5F * tile.joint),
      mix(0.3F * (1.0F + 0.4F * weather + 0.3F * tile.nir), 0.45F, moss) *
          (1.0F - 0.45F * tile.joint),
      0.0F, 0.0F, 0.02F};
}

}  // namespace topoloc::world::patterns

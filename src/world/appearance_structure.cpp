// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/patterns.hpp"

#include <cmath>

namespace topoloc::world::patterns {

using namespace noise;

namespace {

// What rain draws down a wall.
float streaks(const Spot& s, float width_m) {
  return octave(s.u, s.v * 0.07F, width_m, s.seed + 40U, s.footprint) +
         0.6F * octave(s.u, s.v * 0.12F, 3.1F * width_m, s.seed + 41U, s.footprint);
}

}  // namespace

// p: kind 0 cast in forms, 1 kerb stones, 2 smooth trim, 3 rough plinth; tone.
Appearance concrete(const Spot& s) {
  const float tone = s.p[1];
  const int kind = static_cast<int>(s.p[0]);
  float relief = 0.22F * octave(s.u, s.v, 0.02F, s.seed, s.footprint) +
                 0.24F * octave(s.u, s.v, 0.14F, s.seed + 1U, s.footprint) +
                 0.26F * octave(s.u, s.v, 0.9F, s.seed + 2U, s.footprint);
  float dark = 0.0F;
  if (kind == 0) {
    relief += 0.22F * streaks(s, 0.13F);
    const float joint = std::min(
        1.0F, repeated(s.u, 2.4F, 0.012F, s.footprint) + repeated(s.v, 1.2F, 0.012F, s.footprint));
    const float panel = unit(cell(s.u / 2.4F), cell(s.v / 1.2F), s.seed + 3U) - 0.5F;
    relief += 0.16F * panel * fade(1.2F, s.footprint);
    // Holes of the formwork's ties.
    const float tx = s.u - 0.6F - whole((s.u - 0.6F) / 1.2F + 0.5F) * 1.2F;
    const float ty = s.v - 0.3F - whole((s.v - 0.3F) / 0.6F + 0.5F) * 0.6F;
    const float hole =
        band(std::sqrt(tx * tx + ty * ty), -1.0F, 0.025F, s.footprint) * fade(0.06F, s.footprint);
    dark = std::max(0.55F * joint, 0.7F * hole);
  } else if (kind == 1) {
    const float joint = repeated(s.u, 1.0F, 0.012F, s.footprint);
    relief += 0.2F * (unit(cell(s.u), 0U, s.seed + 4U) - 0.5F) * fade(1.0F, s.footprint);
    // Tyres rub on kerbs.
    relief -= 0.3F * ramp(value(s.u / 1.7F, 0.5F, s.seed + 5U), 0.6F, 0.8F);
    dark = 0.6F * joint;
  } else if (kind == 3) {
    relief += 0.3F * octave(s.u, s.v, 0.05F, s.seed + 6U, s.footprint) + 0.15F * streaks(s, 0.2F);
  }
  return {tone * (1.0F + relief) * (1.0F - dark),
          (0.34F + 0.1F * (unit(s.seed) - 0.5F)) * (1.0F + 0.5F * relief) * (1.0F - 0.8F * dark),
          0.0F, 0.0F, 0.01F};
}

// p: width and height of panels, tone, height of the coloured band (0: none).
//
// All panels are alike, joints and bolts too; only soot, streaks and a scratch here and there tell
// one from the other, and little.
Appearance tunnel_wall(const Spot& s) {
  const float tone = s.p[2];
  const float x = s.u - whole(s.u / s.p[0]) * s.p[0];
  const float y = s.v - whole(s.v / s.p[1]) * s.p[1];
  const float joint = std::min(1.0F, repeated(s.u, s.p[0], 0.018F, s.footprint) +
                                         repeated(s.v, s.p[1], 0.018F, s.footprint));
  const auto bolt_at = [&](float bx, float by) {
    const float dx = x - bx;
    const float dy = y - by;
    return band(std::sqrt(dx * dx + dy * dy), -1.0F, 0.022F, s.footprint);
  };
  float bolts = 0.0F;
  if (s.footprint < 0.1F) {
    bolts = bolt_at(0.1F, 0.1F) + bolt_at(s.p[0] - 0.1F, 0.1F) + bolt_at(0.1F, s.p[1] - 0.1F) +
            bolt_at(s.p[0] - 0.1F, s.p[1] - 0.1F);
  }
  const float soot = 0.2F * octave(s.u * 0.35F, s.v, 0.8F, s.seed, s.footprint) +
                     0.14F * octave(s.u, s.v * 0.15F, 0.22F, s.seed + 1U, s.footprint) +
                     0.1F * octave(s.u, s.v, 0.07F, s.seed + 2U, s.footprint);
  // Splash from the road at the foot.
  const float splash = 0.35F * (1.0F - ramp(s.v, 0.1F, 1.0F)) *
                       (0.6F + 0.8F * octave(s.u, s.v, 0.5F, s.seed + 3U, s.footprint));
  const float scratch =
      ramp(value(s.u / 23.0F, 0.5F, s.seed + 4U), 0.75F, 0.8F) *
      band(s.v, 0.8F + 0.004F * s.u - 0.004F * 23.0F * whole(s.u / 23.0F),
           0.86F + 0.004F * s.u - 0.004F * 23.0F * whole(s.u / 23.0F), s.footprint);
  const float stripe = s.p[3] > 0.0F ? band(s.v, s.p[3], s.p[3] + 0.25F, s.footprint) : 0.0F;
  const float relief = soot - splash;
  float albedo = tone * (1.0F + relief) * (1.0F - 0.65F * joint) * (1.0F - 0.5F * bolts);
  albedo *= 1.0F - 0.55F * stripe - 0.4F * scratch;
  const float nir = 0.55F * (1.0F + 0.6F * relief) * (1.0F - 0.7F * joint) * (1.0F - 0.3F * bolts) *
                    (1.0F - 0.1F * stripe);
  // Enamel under soot and splash: as glossy as any paint, but no image is to be seen in it.
  constexpr float kGloss = 0.05F;
  return {albedo, nir, 0.0F, 0.0F, kGloss};
}

// p: tone.
Appearance pole(const Spot& s) {
  const float relief = 0.2F * octave(s.u, s.v, 0.06F, s.seed, s.footprint) +
                       0.25F * octave(s.u, s.v * 0.3F, 0.3F, s.seed + 1U, s.footprint);
  const float nir = s.p[0] < 0.1F ? 0.08F : 0.3F + 0.3F * s.p[0];
  return {s.p[0] * (1.0F + relief), nir * (1.0F + 0.4F * relief), 0.0F, 0.0F, 0.05F};
}

// p: kind 0 painted metal, 1 wood, 2 striped cloth, 3 cabinet with stickers; tone.
Appearance fence(const Spot& s) {
  const int kind = static_cast<int>(s.p[0]);
  // Copies of one thing need not look alike.
  const std::uint32_t seed = s.seed + s.instance;
  float tone = s.p[1];
  float relief = 0.15F * octave(s.u, s.v, 0.05F, seed, s.footprint) +
                 0.2F * octave(s.u, s.v, 0.5F, seed + 1U, s.footprint);
  float nir = 0.3F + 0.3F * unit(seed);
  if (kind == 1) {
    relief += 0.4F * octave(s.u * 6.0F, s.v * 0.6F, 0.09F, seed + 2U, s.footprint);
    nir = 0.5F;
  } else if (kind == 2) {
    const float stripe = repeated(s.u, 0.4F, 0.2F, s.footprint);
    tone = mix(tone, 0.75F, stripe);
    nir = 0.62F;
  } else if (kind == 3) {
    const std::uint32_t key = hash(cell(s.u / 0.22F), cell(s.v / 0.18F), seed + 3U);
    if (unit(key) < 0.22F) {
      const float x = s.u / 0.22F - whole(s.u / 0.22F);
      const float y = s.v / 0.18F - whole(s.v / 0.18F);
      const float share =
          band(x, 0.15F, 0.8F, s.footprint / 0.22F) * band(y, 0.2F, 0.85F, s.footprint / 0.18F);
      const float ink = letter((x - 0.2F) * 1.1F, (y - 0.25F) * 1.9F, s.footprint * 8.0F, key);
      tone = mix(tone, mix(0.75F, 0.1F, ink), share);
    }
  }
  if (s.instance != 0U && kind == 0) {
    tone *= 0.6F + 0.9F * unit(again(s.instance));
  }
  return {tone * (1.0F + relief), nir * (1.0F + 0.4F * relief), 0.0F, 0.0F, 0.03F};
}

Appearance guard_rail(const Spot& s) {
  const float relief = 0.2F * octave(s.u, s.v, 0.04F, s.seed, s.footprint) +
                       0.3F * octave(s.u * 0.4F, s.v, 0.25F, s.seed + 1U, s.footprint) +
                       0.25F * octave(s.u, s.v, 2.2F, s.seed + 2U, s.footprint);
  // Rails overlap every 4 m.
  const float joint = repeated(s.u, 4.0F, 0.02F, s.footprint);
  const float rust = mix(0.08F, ramp(value(s.u / 1.9F, s.v / 0.2F, s.seed + 3U), 0.8F, 0.9F),
                         fade(0.4F, s.footprint));
  return {0.42F * (1.0F + relief) * (1.0F - 0.5F * joint) * (1.0F - 0.45F * rust),
          0.45F * (1.0F + 0.4F * relief) * (1.0F - 0.4F * joint), 0.02F, 0.0F, 0.1F};
}

// p: light of its own; 1: lit by day as well.
Appearance lamp(const Spot& s) { return {0.7F, 0.5F, 0.0F, s.p[0], 0.05F, s.p[1] > 0.0F}; }

}  // namespace topoloc::world::patterns

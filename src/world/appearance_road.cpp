// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/patterns.hpp"

#include <cmath>

namespace topoloc::world::patterns {
namespace {

using namespace noise;

/// What lies on or in the asphalt at a place.
struct Inlay {
  float share = 0.0F;  ///< how much of the spot it covers
  float tone = 1.0F;   ///< times the asphalt's
  float seam = 0.0F;   ///< share of the bitumen line around it
};

// A trench that was filled: a rectangle of other asphalt with sealed edges.
Inlay patch(const Spot& s, float share) {
  constexpr float kLong_m = 8.0F;
  constexpr float kWide_m = 2.9F;
  const std::uint32_t key = hash(cell(s.u / kLong_m), cell(s.v / kWide_m), s.seed + 11U);
  Inlay result;
  if (unit(key) > share) {
    return result;
  }
  const std::uint32_t more = again(key);
  const float x = s.u - whole(s.u / kLong_m) * kLong_m;
  const float y = s.v - whole(s.v / kWide_m) * kWide_m;
  const float x0 = 0.2F + 2.5F * unit(more);
  const float x1 = kLong_m - 0.2F - 4.0F * unit(again(more));
  const float y0 = 0.1F + 0.9F * unit(more + 1U);
  const float y1 = kWide_m - 0.1F - 0.9F * unit(more + 2U);
  const float inside = band(x, x0, x1, s.footprint) * band(y, y0, y1, s.footprint);
  constexpr float kSeam_m = 0.035F;
  const float outer = band(x, x0 - kSeam_m, x1 + kSeam_m, s.footprint) *
                      band(y, y0 - kSeam_m, y1 + kSeam_m, s.footprint);
  result.share = inside;
  result.tone = unit(more + 3U) < 0.6F ? 0.62F + 0.2F * unit(more + 4U) : 1.2F;
  result.seam = outer - inside;
  return result;
}

// Covers of manholes and the like: round iron plates with a pattern.
Inlay cover(const Spot& s) {
  constexpr float kLong_m = 9.0F;
  constexpr float kWide_m = 2.2F;
  const std::uint32_t key = hash(cell(s.u / kLong_m), cell(s.v / kWide_m), s.seed + 23U);
  Inlay result;
  if (unit(key) > 0.2F) {
    return result;
  }
  const std::uint32_t more = again(key);
  const float x = s.u - whole(s.u / kLong_m) * kLong_m - (1.0F + 7.0F * unit(more));
  const float y = s.v - whole(s.v / kWide_m) * kWide_m - (0.5F + 1.2F * unit(more + 1U));
  const float radius = unit(more + 2U) < 0.6F ? 0.32F : 0.13F;
  const float r = std::sqrt(x * x + y * y);
  if (r > radius + 0.1F + s.footprint) {
    return result;
  }
  result.share = band(r, -1.0F, radius, s.footprint);
  result.seam = band(r, radius, radius + 0.03F, s.footprint);
  const float ribs = repeated(x + 10.0F, 0.06F, 0.025F, s.footprint) *
                     repeated(y + 10.0F, 0.06F, 0.025F, s.footprint);
  result.tone = 1.35F - 1.4F * ribs - 0.5F * band(r, 0.8F * radius, 0.86F * radius, s.footprint);
  return result;
}

// Lines where noise passes its middle: they branch and end like cracks.
float crack(float x, float y, float cell_m, float width_m, std::uint32_t seed, float footprint) {
  const float wide = std::max(width_m, 0.5F * footprint);
  if (wide > 0.3F * cell_m) {
    return 0.0F;
  }
  // A slope of value noise is about 1 in a cell.
  const float distance = std::abs(value(x / cell_m, y / cell_m, seed) - 0.5F) * cell_m;
  return clamp01((wide - distance) / wide + 0.3F) * std::min(1.0F, width_m / wide);
}

// Tyres that braked hard: two dark stripes.
float skid(const Spot& s) {
  constexpr float kLong_m = 45.0F;
  constexpr float kWide_m = 3.3F;
  const std::uint32_t key = hash(cell(s.u / kLong_m), cell(s.v / kWide_m), s.seed + 31U);
  if (unit(key) > (s.p[1] > 0.5F ? 0.08F : 0.2F)) {
    return 0.0F;
  }
  const std::uint32_t more = again(key);
  const float x = s.u - whole(s.u / kLong_m) * kLong_m;
  const float begin = 3.0F + 15.0F * unit(more);
  const float end = begin + 5.0F + 18.0F * unit(more + 1U);
  const float drift = 0.012F * (unit(more + 2U) - 0.5F) * (x - begin);
  const float y = s.v - whole(s.v / kWide_m) * kWide_m - 0.3F - 0.8F * unit(more + 3U) - drift;
  const float tyres = band(y, 0.0F, 0.17F, s.footprint) + band(y, 1.45F, 1.62F, s.footprint);
  return tyres * ramp(x, begin, begin + 4.0F) * (1.0F - ramp(x, end - 1.0F, end));
}

}  // namespace

// p: age 0 to 1, town's features 0 or 1, spacing of joints (0: none), tone.
Appearance asphalt(const Spot& s) {
  const float age = s.p[0];
  const float tone = s.p[3];
  // Stones, clods, wheel tracks, weather.
  float relief = 0.75F * octave(s.u, s.v, 0.014F, s.seed, s.footprint) +
                 0.4F * octave(s.u, s.v, 0.045F, s.seed + 1U, s.footprint) +
                 0.26F * octave(s.u, s.v, 0.22F, s.seed + 2U, s.footprint) +
                 0.3F * octave(s.u, s.v, 1.3F, s.seed + 3U, s.footprint) +
                 0.22F * octave(s.u * 0.07F, s.v, 0.5F, s.seed + 4U, s.footprint);
  float nir = 0.085F + 0.35F * tone + 0.03F * octave(s.u, s.v, 0.35F, s.seed + 5U, s.footprint);
  float albedo = tone * (1.0F + relief);
  nir += 0.2F * tone * relief;

  const Inlay old = patch(s, s.p[1] > 0.5F ? 0.1F + 0.25F * age : 0.05F + 0.08F * age);
  albedo *= mix(1.0F, old.tone, old.share) * (1.0F - 0.6F * old.seam);
  nir *= mix(1.0F, 0.5F + 0.5F * old.tone, old.share) * (1.0F - 0.5F * old.seam);

  // Cracks come in fields; sealed ones are broad black snakes.
  const float field = value(s.u / 9.0F, s.v / 4.0F, s.seed + 6U);
  const float cracked = ramp(field, 0.85F - 0.4F * age, 1.0F - 0.35F * age);
  if (cracked > 0.0F) {
    // Jagged, not like contour lines: the place is shaken first.
    const float shake = 0.3F * (value(s.u / 0.13F, s.v / 0.13F, s.seed + 12U) - 0.5F);
    const float line =
        cracked * crack(s.u + shake, s.v - shake, 0.7F, 0.011F, s.seed + 7U, s.footprint);
    albedo *= 1.0F - 0.65F * line;
    nir *= 1.0F - 0.5F * line;
  }
  const float sealed = ramp(value(s.u / 21.0F, s.v / 6.0F, s.seed + 8U), 0.68F, 0.72F);
  if (sealed > 0.0F) {
    const float line =
        sealed * crack(s.u * 0.35F, s.v * 1.2F, 1.7F, 0.02F, s.seed + 9U, 0.6F * s.footprint);
    albedo *= 1.0F - 0.6F * line;
    nir *= 1.0F - 0.55F * line;
  }
  const float rubber = skid(s);
  albedo *= 1.0F - 0.33F * rubber;
  nir *= 1.0F - 0.3F * rubber;
  float gloss = 0.02F;
  if (s.p[1] > 0.5F) {
    const Inlay iron = cover(s);
    albedo = mix(albedo, 0.085F * iron.tone, iron.share) * (1.0F - 0.7F * iron.seam);
    nir = mix(nir, 0.05F, iron.share) * (1.0F - 0.5F * iron.seam);
    gloss += 0.08F * iron.share;
  }
  if (s.p[2] > 0.0F) {
    const float joint = std::min(
        1.0F, repeated(s.u, s.p[2], 0.02F, s.footprint) + repeated(s.v, 3.6F, 0.02F, s.footprint));
    albedo *= 1.0F - 0.7F * joint;
    nir *= 1.0F - 0.6F * joint;
    const float slab = unit(cell(s.u / s.p[2]), cell(s.v / 3.6F), s.seed + 10U) - 0.5F;
    albedo *= 1.0F + 0.12F * slab * fade(3.6F, s.footprint);
  }
  return {albedo, nir, 0.0F, 0.0F, gloss};
}

// p: wear 0 to 1, tone of the road below.
Appearance road_marking(const Spot& s) {
  const float wear = s.p[0] * (0.6F + 0.8F * value(s.u / 13.0F, s.v / 5.0F, s.seed));
  const float chips = 0.5F + 0.55F * octave(s.u, s.v, 0.05F, s.seed + 1U, s.footprint) +
                      0.55F * octave(s.u, s.v, 0.16F, s.seed + 2U, s.footprint) +
                      0.3F * octave(s.u, s.v, 0.6F, s.seed + 3U, s.footprint);
  const float soft = 0.08F + 0.5F * clamp01(s.footprint / 0.1F);
  const float paint = clamp01((chips - 0.55F * wear) / soft + 0.5F);
  const float dirt = 1.0F - 0.25F * wear + 0.2F * octave(s.u, s.v, 0.9F, s.seed + 4U, s.footprint);
  return {mix(s.p[1] * 1.1F, 0.66F * dirt, paint), mix(0.14F, 0.52F * dirt, paint),
          0.3F * paint * dirt, 0.0F, 0.02F};
}

// p: 0 slabs, 1 small stones, 2 asphalt with patches; tone.
Appearance pavement(const Spot& s) {
  const float tone = s.p[1];
  const float stains = 0.3F * octave(s.u, s.v, 0.03F, s.seed, s.footprint) +
                       0.25F * octave(s.u, s.v, 0.3F, s.seed + 1U, s.footprint) +
                       0.3F * octave(s.u, s.v, 1.6F, s.seed + 2U, s.footprint);
  if (s.p[0] > 1.5F) {
    Appearance result = asphalt({s.u, s.v, s.footprint, s.seed, s.instance, s.p});
    const float relief = stains + 0.3F * octave(s.u, s.v, 0.012F, s.seed + 3U, s.footprint);
    result.albedo = 0.5F * tone * (1.0F + relief);
    result.nir = 0.2F * (1.0F + 0.5F * relief);
    return result;
  }
  const bool slabs = s.p[0] < 0.5F;
  const float long_m = slabs ? 0.5F : 0.2F;
  const float wide_m = slabs ? 0.5F : 0.1F;
  const float row = whole(s.v / wide_m);
  const float shifted = s.u + (slabs ? 0.0F : 0.5F * long_m * (row - 2.0F * whole(row / 2.0F)));
  const float joint = std::min(1.0F, repeated(shifted, long_m, 0.01F, s.footprint) +
                                         repeated(s.v, wide_m, 0.01F, s.footprint));
  const std::uint32_t key = hash(cell(shifted / long_m), cell(s.v / wide_m), s.seed + 4U);
  const float one = (unit(key) - 0.5F) * fade(wide_m, s.footprint);
  const float broken = unit(again(key)) < 0.03F ? 0.25F * fade(wide_m, s.footprint) : 0.0F;
  // Chewing gum.
  const float gum = slabs ? ramp(value(s.u / 0.09F, s.v / 0.09F, s.seed + 5U), 0.86F, 0.9F) *
                                fade(0.06F, s.footprint)
                          : 0.0F;
  const float relief = stains + 0.3F * one - 0.45F * joint - broken - 0.35F * gum;
  const float other = 0.25F * (unit(again(key) + 1U) - 0.5F) * fade(wide_m, s.footprint);
  return {tone * (1.0F + relief), 0.3F * (1.0F + 0.5F * stains + other - 0.4F * joint), 0.0F, 0.0F,
          0.01F};
}

}  // namespace topoloc::world::patterns

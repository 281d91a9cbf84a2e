// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/patterns.hpp"

#include <cmath>

/// Plants are dark in visible light and bright in the near infrared, and not in the same places.
namespace topoloc::world::patterns {

using namespace noise;

// p: 1 for blades, 0 for land seen from above; share of bare earth.
Appearance grass(const Spot& s) {
  if (s.p[0] > 0.5F) {
    const float blade = octave(s.u, s.v, 0.4F, s.seed + s.instance, s.footprint);
    return {0.13F + 0.14F * blade, 0.48F + 0.2F * blade, 0.0F, 0.0F, 0.0F};
  }
  const float fine = 0.7F * octave(s.u, s.v, 0.03F, s.seed, s.footprint) +
                     0.5F * octave(s.u, s.v, 0.11F, s.seed + 1U, s.footprint) +
                     0.5F * octave(s.u, s.v, 0.5F, s.seed + 2U, s.footprint);
  const float broad = 0.45F * octave(s.u, s.v, 3.1F, s.seed + 3U, s.footprint) +
                      0.4F * octave(s.u, s.v, 17.0F, s.seed + 4U, s.footprint) +
                      0.5F * octave(s.u, s.v, 80.0F, s.seed + 5U, s.footprint);
  const float bare = ramp(0.5F + octave(s.u, s.v, 1.9F, s.seed + 6U, s.footprint) +
                              0.5F * octave(s.u, s.v, 0.3F, s.seed + 7U, s.footprint),
                          0.74F, 0.84F);
  const float albedo = 0.135F * (1.0F + fine + broad);
  const float nir = 0.46F * (1.0F + 0.35F * fine - 0.2F * broad);
  return {mix(albedo, 0.2F * (1.0F + fine), bare), mix(nir, 0.3F, bare), 0.0F, 0.0F, 0.0F};
}

// p: 0 yard, 1 field with furrows; tone.
Appearance ground(const Spot& s) {
  float relief = 0.6F * octave(s.u, s.v, 0.025F, s.seed, s.footprint) +
                 0.4F * octave(s.u, s.v, 0.1F, s.seed + 1U, s.footprint) +
                 0.4F * octave(s.u, s.v, 0.7F, s.seed + 2U, s.footprint) +
                 0.35F * octave(s.u, s.v, 5.0F, s.seed + 3U, s.footprint) +
                 0.35F * octave(s.u, s.v, 60.0F, s.seed + 4U, s.footprint);
  if (s.p[0] > 0.5F) {
    const float bend = 6.0F * value(s.u / 70.0F, s.v / 70.0F, s.seed + 5U);
    relief += 0.3F * (repeated(s.v + bend, 1.6F, 0.8F, s.footprint) - 0.5F);
  }
  return {s.p[1] * (1.0F + relief), 0.3F * (1.0F + 0.5F * relief), 0.0F, 0.0F, 0.0F};
}

// p: how light the leaf is.
Appearance foliage(const Spot& s) {
  const std::uint32_t seed = s.seed + s.instance * 7U;
  const float relief =
      0.9F * octave(s.u, s.v, 0.05F, seed, s.footprint) +
      0.9F * octave(s.u, s.v, 1.0F, seed + 1U, s.footprint);  // one leaf and another
  const float kind = 0.7F + 0.6F * unit(s.instance);
  return {(0.07F + 0.06F * s.p[0]) * kind * (1.0F + relief),
          0.44F * (1.0F + 0.35F * relief) + 0.1F * (unit(again(seed)) - 0.5F), 0.0F, 0.0F, 0.03F};
}

Appearance bark(const Spot& s) {
  const std::uint32_t seed = s.seed + s.instance;
  const float relief = 1.1F * octave(s.u, s.v * 0.2F, 0.035F, seed, s.footprint) +
                       0.6F * octave(s.u, s.v * 0.5F, 0.12F, seed + 1U, s.footprint) +
                       0.5F * octave(s.u, s.v, 0.5F, seed + 2U, s.footprint);
  return {0.13F * (1.0F + relief), 0.34F * (1.0F + 0.6F * relief), 0.0F, 0.0F, 0.0F};
}

}  // namespace topoloc::world::patterns

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/surface.hpp"

#include "world/noise.hpp"

#include <array>
#include <cstdint>

/// Patterns of the materials, by family; appearance() picks one.
namespace topoloc::world::patterns {

/// A place of a surface.
struct Spot {
  float u;  ///< metres
  float v;
  float footprint;
  std::uint32_t seed;      ///< of the surface
  std::uint32_t instance;  ///< of what it belongs to
  const std::array<float, 4>& p;
};

Appearance asphalt(const Spot& spot);
Appearance road_marking(const Spot& spot);
Appearance pavement(const Spot& spot);
Appearance concrete(const Spot& spot);
Appearance tunnel_wall(const Spot& spot);
Appearance grass(const Spot& spot);
Appearance ground(const Spot& spot);
Appearance foliage(const Spot& spot);
Appearance bark(const Spot& spot);
Appearance facade(const Spot& spot);
Appearance roof(const Spot& spot);
Appearance window(const Spot& spot);
Appearance shop_front(const Spot& spot);
Appearance door(const Spot& spot);
Appearance sign(const Spot& spot);
Appearance plate(const Spot& spot);
Appearance pole(const Spot& spot);
Appearance fence(const Spot& spot);
Appearance guard_rail(const Spot& spot);
Appearance car_body(const Spot& spot);
Appearance car_glass(const Spot& spot);
Appearance tyre(const Spot& spot);
Appearance lamp(const Spot& spot);

/// Share of ink at a place of a line of made-up letters: `x` along in letter heights, `y` in
/// [0, 1] up; `footprint` in letter heights.
float lettering(float x, float y, float footprint, std::uint32_t seed, int letters);
/// Ink of one letter in a cell of 0.62 x 1.
float letter(float x, float y, float footprint, std::uint32_t seed);

}  // namespace topoloc::world::patterns

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "world/world_maker.hpp"

#include <cstdint>
#include <numbers>

/// What stands beside roads.
namespace topoloc::world {

// Of Lamp::intensity. 2000 cd are 7500 lm in the cone of a street lamp.
constexpr double kStreetLampIntensity = 0.02;
constexpr double kHighwayLampIntensity = 0.05;  // 5000 cd, 19 klm
constexpr double kStreetLamp_m = 6.5;
constexpr double kStreetLampArm_m = 1.1;
constexpr double kHighwayLamp_m = 10.0;
constexpr double kHighwayLampArm_m = 2.2;

/// Appearance::emission of a lamp's face, see Lamp::intensity.
inline float lamp_emission(double intensity, double area_m2) {
  return static_cast<float>(std::numbers::pi * intensity / area_m2);
}

enum class SignShape : std::uint8_t { kRound, kTriangle, kBoard };

/// Sign on a post; its face looks along -x, to who drives along +x.
void add_sign_post(MeshBuilder& builder, Random& random, double height_m, double size_m,
                   SignShape shape);

}  // namespace topoloc::world

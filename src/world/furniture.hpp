// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "world/world_maker.hpp"

#include <cstdint>

/// What stands beside roads.
namespace topoloc::world {

constexpr double kStreetLamp_m = 6.5;
constexpr double kStreetLampArm_m = 1.1;
constexpr double kHighwayLamp_m = 10.0;
constexpr double kHighwayLampArm_m = 2.2;

enum class SignShape : std::uint8_t { kRound, kTriangle, kBoard };

/// Sign on a post; its face looks along -x, to who drives along +x.
void add_sign_post(MeshBuilder& builder, Random& random, double height_m, double size_m,
                   SignShape shape);

}  // namespace topoloc::world

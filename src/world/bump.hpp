// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/route.hpp"
#include "topoloc/world/world.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace topoloc::world {

/// Height of the road above the route's line: roughness, dips and, in town, speed bumps.
double bump_at(std::uint64_t seed, const Route& route, const std::vector<Section>& sections,
               double along_m, double left_m);

/// Middle of the speed bump in a piece of road of kSpeedBumpPiece_m, if it has one.
constexpr double kSpeedBumpPiece_m = 240.0;
std::optional<double> speed_bump_in(std::uint64_t seed, const Route& route,
                                    const std::vector<Section>& sections, std::int64_t piece);
constexpr double kSpeedBumpHalf_m = 2.2;

/// The same as the mesh of the road has it: straight between places kStation_m apart.
constexpr double kStation_m = 0.5;
double mesh_bump(const World& world, double along_m, double left_m);

}  // namespace topoloc::world

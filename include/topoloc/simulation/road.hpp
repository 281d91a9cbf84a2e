// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/route.hpp"

#include <functional>

namespace topoloc::world {
struct World;
}

namespace topoloc::simulation {

/// What the vehicle's motion needs to know of the world.
struct Road {
  const world::Route* route = nullptr;
  std::function<double(double along_m)> lane_left_m;  ///< middle of the lane that is driven
  std::function<double(double along_m)> speed_limit_mps;
  std::function<double(double along_m, double left_m)> bump_m;
};

/// `world` has to outlive it.
Road road_of(const world::World& world);

}  // namespace topoloc::simulation

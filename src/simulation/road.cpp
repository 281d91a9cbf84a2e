// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/road.hpp"

#include "topoloc/world/world.hpp"

namespace topoloc::simulation {

Road road_of(const world::World& world) {
  return {
      .route = &world.route,
      .lane_left_m = [&world](double along_m) { return world.lanes(along_m).front().left_m; },
      .speed_limit_mps = [&world](double along_m) { return world.speed_limit_mps(along_m); },
      .bump_m = [&world](double along_m, double left_m) { return world.bump_m(along_m, left_m); }};
}

}  // namespace topoloc::simulation

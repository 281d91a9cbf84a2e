// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/simulation/ego.hpp"

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

namespace topoloc::simulation::testing {

/// A road without a world around it.
struct ToyRoad {
  explicit ToyRoad(std::vector<world::Stretch> stretches, double limit_mps = 13.9)
      : route(std::make_unique<world::Route>(std::move(stretches))),
        road{.route = route.get(),
             .lane_left_m = [](double) { return -1.75; },
             .speed_limit_mps = [limit_mps](double) { return limit_mps; },
             .bump_m =
                 [](double along_m, double left_m) {
                   return 0.004 * std::sin(0.9 * along_m + 0.5 * left_m) +
                          0.002 * std::sin(3.1 * along_m - 1.1 * left_m);
                 }} {}

  std::unique_ptr<world::Route> route;
  Road road;
};

/// Half a kilometre of town with a hill and turns down to 18 m of radius.
inline ToyRoad town_road() {
  using world::Setting;
  return ToyRoad({{Setting::kTown, 80.0, 0.0, 0.02},
                  {Setting::kTown, 20.0, 1.0 / 18.0, 0.04},
                  {Setting::kTown, 15.0, 1.0 / 18.0, 0.04},
                  {Setting::kTown, 20.0, 0.0, 0.0},
                  {Setting::kTown, 120.0, -0.005, -0.03},
                  {Setting::kTown, 25.0, -1.0 / 30.0, 0.0},
                  {Setting::kTown, 25.0, 0.0, 0.0},
                  {Setting::kTown, 195.0, 0.002, 0.01}});
}

inline ToyRoad highway_road() {
  using world::Setting;
  return ToyRoad({{Setting::kHighway, 600.0, 0.001, 0.02},
                  {Setting::kTunnel, 300.0, -0.001, -0.01},
                  {Setting::kHighway, 600.0, 0.0, 0.0}},
                 30.0);
}

}  // namespace topoloc::simulation::testing

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/world.hpp"

#include <vector>

namespace topoloc::world {

/// Models of vehicles that a world has at least, if it has any: cars that park and a van, then a
/// lorry and a bus.
constexpr int kLightModels = 5;
constexpr int kHeavyModels = 2;
constexpr int kCarModels = kLightModels + kHeavyModels;

/// Lanes as streams of vehicles: the right side's slots, then the left side's. All vehicles of a
/// stream take the same time between two places, so none ever runs into another.
std::vector<std::vector<double>> travel_times(const World& world);

}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/config/vehicle_config.hpp"
#include "topoloc/map/types.hpp"
#include "topoloc/mapping/map_builder.hpp"

#include <span>
#include <string>

namespace topoloc::mapping {

/// Everything that a node depends on, as text: two builds with the same text make the same nodes.
/// Input files are named by path, size and time of change.
std::string describe_settings(const BuildPaths& paths, const BuildConfig& config,
                              const config::VehicleConfig& vehicle, const map::MapInfo& info,
                              std::span<const PlannedNode> nodes);

/// Everything that refined poses depend on. The program's file is among it: its constants count.
std::string describe_pose_settings(const BuildPaths& paths, const config::VehicleConfig& vehicle,
                                   const PoseRefiner& refiner);

}  // namespace topoloc::mapping

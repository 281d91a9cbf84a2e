// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/simulation/drive_spec.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

namespace topoloc::simulation {

/// What became of it.
struct DriveSummary {
  double road_m = 0.0;  ///< of the world
  double duration_s = 0.0;
  double way_m = 0.0;  ///< driven
  double reversed_m = 0.0;
  double standing_s = 0.0;
  std::uint64_t imu_samples = 0;
  std::uint64_t wheel_samples = 0;
  std::uint64_t gnss_fixes = 0;
  CameraLogCounts camera;
  SurveyCounts survey;
  std::map<std::string, double>
      stage_s;  ///< computing time by stage: world, sensors, cloud, images
};

/// Called with the stage and its share done; what it throws ends the simulation.
using StageProgress = std::function<void(const std::string& stage, double share)>;

/// Makes the files of a drive in an existing, empty folder. The same request gives the same bytes,
/// whatever the number of threads. Throws std::runtime_error.
DriveSummary simulate_drive(const DriveRequest& request, const std::filesystem::path& folder,
                            const StageProgress& progress);

}  // namespace topoloc::simulation

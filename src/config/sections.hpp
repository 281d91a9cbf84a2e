// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/config/vehicle_config.hpp"

#include "config/strict_node.hpp"

/// The sections of vehicle.yaml. Each function reads its keys from `top`, keeps the defaults of
/// absent ones, and is the only place that knows their names and ranges.
namespace topoloc::config {

void read_can(StrictNode& top, can::VehicleSignalsConfig& config);
/// These two name the files that they read in `files`.
void read_camera(StrictNode& top, CameraConfig& config, std::vector<std::filesystem::path>& files);
void read_imu(StrictNode& top, estimation::EstimatorConfig& config,
              std::vector<std::filesystem::path>& files);
void read_mounting(StrictNode& top, estimation::SpeedModel& model);
void read_speed(StrictNode& top, estimation::EstimatorConfig& config);
void read_standstill(StrictNode& top, estimation::StandstillModel& model);
void read_estimator(StrictNode& top, estimation::EstimatorConfig& config);
void read_matching(StrictNode& top, matching::MatchingConfig& config);
void read_live(StrictNode& top, LiveConfig& config);

}  // namespace topoloc::config

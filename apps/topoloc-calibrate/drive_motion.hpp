// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/speed_measurement.hpp"
#include "topoloc/evaluation/imu_bias.hpp"
#include "topoloc/evaluation/mounting.hpp"

#include <filesystem>
#include <vector>

/// What calibration takes from a drive folder.
struct DriveMotion {
  std::vector<topoloc::evaluation::MotionSample> samples;  ///< of the reference, with wheel speeds
  topoloc::evaluation::Mounting given;                     ///< of vehicle.yaml
  topoloc::evaluation::ImuBias imu_bias;
};

/// What the speed model of a configuration says about the mounting.
topoloc::evaluation::Mounting mounting_of(const topoloc::estimation::SpeedModel& model);

/// Reads a drive with ground_truth.tum, of which only what lies up to `until_s` seconds after the
/// first inertial sample is looked at (0: all). `vehicle` replaces its vehicle.yaml unless empty.
/// Throws std::runtime_error.
DriveMotion read_drive_motion(const std::filesystem::path& drive,
                              const std::filesystem::path& vehicle, double until_s);

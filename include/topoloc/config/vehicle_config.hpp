// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/vehicle_signals.hpp"
#include "topoloc/config/config_error.hpp"
#include "topoloc/config/kalibr.hpp"
#include "topoloc/matching/config.hpp"

#include <filesystem>
#include <string>

#include <Eigen/Core>

/// Configuration of one vehicle: vehicle.yaml and the files it names (docs/vehicle-config.md).
namespace topoloc::config {

struct CameraConfig {
  KalibrCamera kalibr;             ///< lens, T_imu_cam, time offset
  std::string channel = "CAMERA";  ///< LCM channel of its image_t messages
  std::filesystem::path mask;      ///< grey image, 0 = ignore (bonnet); empty: no mask
};

/// How the IMU and the wheels sit in the vehicle; what topoloc-calibrate measures.
struct MountingConfig {
  Eigen::Matrix3d R_vehicle_imu = Eigen::Matrix3d::Identity();  ///< x_vehicle = R x_imu
  /// The point whose velocity the wheels measure, that slips neither sideways nor up, in the IMU
  /// frame [m].
  Eigen::Vector3d wheel_reference_imu_m = Eigen::Vector3d::Zero();
  double wheel_scale = 1.0;  ///< true speed / measured speed
};

struct VehicleConfig {
  std::filesystem::path file;
  std::string name;
  can::VehicleSignalsConfig can;
  CameraConfig camera;
  KalibrImu imu;
  MountingConfig mounting;
  matching::MatchingConfig matching;
};

/// Reads vehicle.yaml; relative paths in it are relative to its folder. Unknown keys, missing keys,
/// wrong types and values out of range throw ConfigError with file, line and key.
VehicleConfig load_vehicle_config(const std::filesystem::path& file);

}  // namespace topoloc::config

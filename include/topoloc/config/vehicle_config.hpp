// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/vehicle_signals.hpp"
#include "topoloc/config/config_error.hpp"
#include "topoloc/config/kalibr.hpp"
#include "topoloc/config/live_config.hpp"
#include "topoloc/estimation/estimator.hpp"
#include "topoloc/matching/config.hpp"

#include <filesystem>
#include <string>
#include <vector>

/// Configuration of one vehicle: vehicle.yaml and the files it names (docs/vehicle-config.md).
namespace topoloc::config {

struct CameraConfig {
  KalibrCamera kalibr;             ///< lens, T_imu_cam, time offset
  std::string channel = "CAMERA";  ///< LCM channel of its image_t messages
  std::filesystem::path mask;      ///< grey image, 0 = ignore (bonnet); empty: no mask

  /// False for a vehicle without a camera: it can only dead-reckon.
  [[nodiscard]] bool configured() const { return kalibr.calibration.pinhole.width_px > 0; }
};

struct VehicleConfig {
  std::string name;
  std::vector<std::filesystem::path> files;  ///< that it was read from, vehicle.yaml first
  can::VehicleSignalsConfig can;
  CameraConfig camera;
  /// With the IMU's noise, the mounting (models.speed) and the undistorted matching camera
  /// (models.camera) filled in.
  estimation::EstimatorConfig estimator;
  matching::MatchingConfig matching;
  LiveConfig live;
};

/// Reads vehicle.yaml; relative paths in it are relative to its folder. Unknown keys, missing keys,
/// wrong types and values out of range throw ConfigError with file, line and key.
VehicleConfig load_vehicle_config(const std::filesystem::path& file);

}  // namespace topoloc::config

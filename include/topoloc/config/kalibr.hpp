// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/config/config_error.hpp"
#include "topoloc/estimation/propagation.hpp"
#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"

#include <cstdint>
#include <filesystem>
#include <string>

/// Kalibr's calibration files, read as they are: keys that are not needed here are ignored.
namespace topoloc::config {

/// One camera of a camchain file.
struct KalibrCamera {
  CameraCalibration calibration;
  RigidTransform T_imu_cam;         ///< inverse of the file's T_cam_imu
  std::int64_t time_offset_ns = 0;  ///< timeshift_cam_imu: t_imu = t_cam + offset
};

/// Reads camera `name` ("cam0") of a camchain file: camera_model pinhole; distortion_model radtan
/// (4 or 5 coefficients), equidistant (4) or none; T_cam_imu a rigid transform. Throws ConfigError.
KalibrCamera load_kalibr_camera(const std::filesystem::path& file, const std::string& name);

/// An imu file.
struct KalibrImu {
  estimation::ImuNoise noise;
  double update_rate_hz = 0.0;
};

/// Reads an imu file: its keys at the top level, or below "imu0" as Kalibr's own output has them.
/// Throws ConfigError.
KalibrImu load_kalibr_imu(const std::filesystem::path& file);

}  // namespace topoloc::config

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/imu_bias.hpp"
#include "topoloc/evaluation/mounting.hpp"

#include "yaml_section.hpp"

#include <cstdio>

namespace topoloc::evaluation {
namespace {

std::string list(const Eigen::Vector3d& v, const char* pattern) {
  char text[128];
  std::snprintf(text, sizeof text, pattern, v.x(), v.y(), v.z());
  return text;
}

std::string number(double value, const char* pattern = "%.5f") {
  char text[32];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

}  // namespace

std::string with_mounting(const std::string& vehicle_yaml, const Mounting& mounting) {
  return with_values(
      vehicle_yaml, "vehicle",
      {{"rotation_vehicle_imu_rpy_rad",
        list(mounting.rotation_vehicle_imu_rpy_rad, "[%.6f, %.6f, %.6f]")},
       {"wheel_reference_imu_m", list(mounting.wheel_reference_imu_m, "[%.4f, %.4f, %.4f]")},
       {"wheel_scale", number(mounting.wheel_scale)}});
}

std::string with_imu_bias(const std::string& vehicle_yaml, const ImuBias& bias) {
  return with_values(vehicle_yaml, "imu",
                     {{"gyro_bias_radps", list(bias.gyro_radps, "[%.6f, %.6f, %.6f]")},
                      {"accel_bias_mps2", list(bias.accel_mps2, "[%.5f, %.5f, %.5f]")},
                      {"gyro_bias_std_radps", number(bias.gyro_std_radps.maxCoeff(), "%.2g")},
                      {"accel_bias_std_mps2", number(bias.accel_std_mps2.maxCoeff(), "%.2g")}});
}

}  // namespace topoloc::evaluation

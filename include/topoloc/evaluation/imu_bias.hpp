// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/measurements.hpp"
#include "topoloc/evaluation/trajectory.hpp"

#include <cstddef>
#include <span>
#include <string>

#include <Eigen/Core>

/// Turn-on biases of an IMU, from the motion of a reference (docs/calibration.md).
namespace topoloc::evaluation {

struct ImuBias {
  Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();      ///< IMU frame
  Eigen::Vector3d accel_mps2 = Eigen::Vector3d::Zero();      ///< a tilt of the IMU against the
                                                             ///< reference's axes is in it
  Eigen::Vector3d gyro_std_radps = Eigen::Vector3d::Zero();  ///< from the scatter between windows
  Eigen::Vector3d accel_std_mps2 = Eigen::Vector3d::Zero();
  std::size_t windows = 0;  ///< of one second; 0: too few, nothing was estimated
};

/// Mean of what the IMU measures less what the reference says, in windows of one second: between
/// the ends of a window the reference's rotation and change of velocity are exact where its
/// derivatives are noisy. `imu` in time order; windows with less than ten samples are left out.
ImuBias estimate_imu_bias(const Trajectory& reference, std::span<const estimation::ImuSample> imu,
                          double gravity_mps2);

/// The text of a vehicle.yaml with the biases and their largest standard deviations in its
/// `imu:` section, as with_mounting does it.
std::string with_imu_bias(const std::string& vehicle_yaml, const ImuBias& bias);

}  // namespace topoloc::evaluation

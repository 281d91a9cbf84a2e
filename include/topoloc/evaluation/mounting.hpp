// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/evaluation/motion.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

/// How the IMU sits in the vehicle, from the motion of a reference (docs/calibration.md).
///
/// The model is the speed measurement of the estimator: R_vehicle_imu (v_imu + w x r) = [v_x, 0, 0]
/// with r the wheel reference point, v_x = wheel_scale * measured speed.
namespace topoloc::evaluation {

struct Parameter {
  double value = 0.0;
  double std = 0.0;  ///< counts correlated residuals once
  /// Is it known well enough to use? Otherwise the value given beforehand stays.
  bool observable = false;
};

/// What is known beforehand and stays where the drive says nothing.
struct Mounting {
  Eigen::Vector3d rotation_vehicle_imu_rpy_rad = Eigen::Vector3d::Zero();  ///< Rz(y) Ry(p) Rx(r)
  Eigen::Vector3d wheel_reference_imu_m = Eigen::Vector3d::Zero();
  double wheel_scale = 1.0;  ///< true speed / measured speed
};

struct MountingOptions {
  Mounting given;
  double min_speed_mps = 3.0;
  double max_lateral_acceleration_mps2 = 2.0;  ///< beyond, tyres slip too much
};

enum class MountingVerdict {
  kOk,
  kTooFewSamples,      ///< too little time above the speed limit
  kResidualsTooLarge,  ///< the reference contradicts itself, or this is no road vehicle
};

struct MountingEstimate {
  MountingVerdict verdict = MountingVerdict::kTooFewSamples;
  std::size_t samples = 0;  ///< used
  std::size_t too_slow = 0;
  std::size_t turning_too_hard = 0;
  Parameter pitch_rad;
  Parameter yaw_rad;
  Parameter lever_x_m;  ///< point without lateral velocity: from lateral velocity over yaw rate
  Parameter lever_y_m;  ///< from wheel speed over yaw rate; needs wheel speeds
  Parameter lever_z_m;  ///< roll centre: from lateral velocity over roll rate
  Parameter wheel_scale;
  Parameter wheel_delay_s;  ///< positive: wheel speeds are stamped late
  /// With tyre slip as a state of its own, lateral velocity of the axle = -slip * v^2 w_z: the
  /// lever arm at walking pace. The estimator has no slip model; it needs lever_x_m.
  Parameter lever_x_without_slip_m;
  Parameter slip_s2pm;
  double lateral_std_mps = 0.0;  ///< robust residuals, what the speed model may expect
  double vertical_std_mps = 0.0;
  double forward_std_mps = 0.0;  ///< 0 without wheel speeds
  Mounting mounting;             ///< observable parameters, the given values for the others
};

/// Robust (Huber) least squares over the samples of one or several drives. Roll cannot be seen in
/// the direction of the velocity and stays as given.
MountingEstimate estimate_mounting(const std::vector<MotionSample>& samples,
                                   const MountingOptions& options = {});

/// The text of a vehicle.yaml with the three keys of its `vehicle:` section replaced or added;
/// everything else, comments included, stays. Throws std::runtime_error where the section is not in
/// block style with one line per key.
std::string with_mounting(const std::string& vehicle_yaml, const Mounting& mounting);

}  // namespace topoloc::evaluation

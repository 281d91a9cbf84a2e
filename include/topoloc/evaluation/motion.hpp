// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/evaluation/trajectory.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

/// Velocity and rotation rate of a reference: what the mounting is calibrated from.
namespace topoloc::evaluation {

struct MotionSample {
  std::int64_t time_ns = 0;
  Eigen::Vector3d velocity_imu_mps = Eigen::Vector3d::Zero();  ///< of the IMU, in its own axes
  Eigen::Vector3d rate_imu_radps = Eigen::Vector3d::Zero();
  double forward_acceleration_mps2 = 0.0;  ///< rate of change of the forward speed
  std::optional<double> wheel_speed_mps;   ///< measured, unscaled
};

/// Differentiates a trajectory: a parabola through all poses within half_window_s on either side of
/// each one. Poses without enough neighbours (4, on both sides) give no sample.
std::vector<MotionSample> differentiate(const Trajectory& trajectory, double half_window_s = 0.25);

/// A drive of a GNSS/INS that states velocity itself, in KITTI's OXTS columns.
struct OxtsDrive {
  std::vector<MotionSample> samples;
  /// 95th percentile of |stated speed - speed between its own positions|: metres per second for
  /// an INS that has not converged.
  double speed_disagreement_mps = 0.0;
};

/// Reads a CSV, plain or gzip, with the columns timestamp_ns, lat_deg, lon_deg, alt_m, roll_rad,
/// pitch_rad, yaw_rad, vf_mps, vl_mps, vu_mps, wx_radps, wy_radps, wz_radps.
///
/// vf and vu are the *level* forward and upward velocity, not along the body axes (on a slope vu
/// equals the climb rate of the positions), and vl as recorded counts to the *right*: only so do
/// the rows of every KITTI drive agree with their own positions (docs/calibration.md).
/// Throws std::runtime_error "file:line: ...".
OxtsDrive read_oxts(const std::filesystem::path& path);

}  // namespace topoloc::evaluation

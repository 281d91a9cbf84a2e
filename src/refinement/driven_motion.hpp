// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/evaluation/trajectory.hpp"
#include "topoloc/refinement/gyro_integral.hpp"

#include <vector>

#include <Eigen/Core>

namespace topoloc::refinement {

/// The way from pose to pose that a filter without a map has driven, turned by the gyro. Forward it
/// is that of the filter's positions; sideways and up, and wherever the vehicle hardly moves, that
/// of its velocities: when the filter finds its heading or tilt to be wrong, it shifts its position
/// to where the way so far must have led, which is no motion. (Its steps forward are nearer to the
/// truth than its velocity, which lags.)
///
/// `v_imu_mps`: of each pose, in the IMU's axes; `forward_imu`: the vehicle's x axis in these.
evaluation::Trajectory driven_motion(const evaluation::Trajectory& filtered,
                                     const std::vector<Eigen::Vector3d>& v_imu_mps,
                                     const Eigen::Vector3d& forward_imu, const GyroIntegral& gyro);

}  // namespace topoloc::refinement

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"

#include <Eigen/Core>

namespace topoloc::estimation {

/// Where each part of the error state stands (the paper's x-tilde). Calibration states that come
/// later are added here and nowhere else.
namespace error_index {
inline constexpr int kTheta = 0;  ///< rotation, right perturbation in IMU axes [rad]
inline constexpr int kP = 3;      ///< position in world axes [m]
inline constexpr int kV = 6;      ///< velocity in world axes [m/s]
inline constexpr int kBa = 9;     ///< accelerometer bias in IMU axes [m/s^2]
inline constexpr int kBg = 12;    ///< gyroscope bias in IMU axes [rad/s]
inline constexpr int kG = 15;     ///< gravity in world axes [m/s^2]
inline constexpr int kDim = 18;
}  // namespace error_index

inline constexpr int kErrorDim = error_index::kDim;

using ErrorVector = Eigen::Matrix<double, kErrorDim, 1>;
using Covariance = Eigen::Matrix<double, kErrorDim, kErrorDim>;
/// Covariance of (theta, p): the leading block of Covariance.
using PoseCovariance = Eigen::Matrix<double, 6, 6>;

/// Nominal state x of the filter, on the manifold SO(3) x R^15.
struct NominalState {
  Eigen::Matrix3d R_world_imu = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_world_imu = Eigen::Vector3d::Zero();      ///< [m]
  Eigen::Vector3d v_world_imu = Eigen::Vector3d::Zero();      ///< [m/s]
  Eigen::Vector3d accel_bias_mps2 = Eigen::Vector3d::Zero();  ///< IMU axes
  Eigen::Vector3d gyro_bias_radps = Eigen::Vector3d::Zero();  ///< IMU axes
  Eigen::Vector3d gravity_mps2 = {0.0, 0.0, -9.81};           ///< world axes, pointing down

  [[nodiscard]] RigidTransform T_world_imu() const { return {R_world_imu, p_world_imu}; }
};

/// x boxplus dx: rotation R Exp(dtheta), all else by addition.
NominalState boxplus(const NominalState& x, const ErrorVector& dx);

/// x boxminus y: the dx with boxplus(y, dx) = x.
ErrorVector boxminus(const NominalState& x, const NominalState& y);

/// True if no element is NaN or infinite.
bool all_finite(const NominalState& x);

}  // namespace topoloc::estimation

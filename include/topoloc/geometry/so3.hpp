// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <Eigen/Core>

/// Rotation group SO(3): exponential, logarithm and their Jacobians.
///
/// Convention everywhere: perturbations act on the right, R = R_hat Exp(dtheta).
/// All functions are exact at zero and smooth through it (series below kSmallAngle_rad).
/// Source: J. Sola, J. Deray, D. Atchuthan, "A micro Lie theory for state estimation in robotics",
/// 2018, equations (132) to (147).
namespace topoloc::so3 {

/// Below this rotation angle the closed forms lose digits and Taylor series take over.
inline constexpr double kSmallAngle_rad = 1e-4;

/// Skew-symmetric matrix [v]x with [v]x w = v x w.
Eigen::Matrix3d skew(const Eigen::Vector3d& v);

/// Rotation matrix of a rotation vector [rad] (Rodrigues).
Eigen::Matrix3d exp(const Eigen::Vector3d& phi_rad);

/// Rotation vector [rad] of a rotation matrix, norm in [0, pi]; well defined at pi too.
Eigen::Vector3d log(const Eigen::Matrix3d& R);

/// Rz(yaw) Ry(pitch) Rx(roll) of [roll, pitch, yaw].
Eigen::Matrix3d from_roll_pitch_yaw(const Eigen::Vector3d& rpy_rad);

/// [roll, pitch, yaw] of a rotation matrix, pitch within +-pi/2, where roll and yaw are lost.
Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& R);

/// Right Jacobian: Exp(phi + d) = Exp(phi) Exp(J_r(phi) d) to first order in d.
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& phi_rad);

/// Inverse of the right Jacobian: Log(Exp(phi) Exp(d)) = phi + J_r^-1(phi) d to first order.
Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& phi_rad);

/// Left Jacobian J_l(phi) = J_r(-phi) = J_r(phi)^T.
inline Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& phi_rad) {
  return right_jacobian(-phi_rad);
}

/// Nearest rotation matrix after rounding has crept in (one Newton step of the polar decomposition;
/// exact to rounding for matrices that were rotations up to about 1e-8).
Eigen::Matrix3d renormalised(const Eigen::Matrix3d& R);

}  // namespace topoloc::so3

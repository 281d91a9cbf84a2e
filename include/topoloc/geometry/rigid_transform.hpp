// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace topoloc {

/// Rigid transform T_a_b: maps points from frame b to frame a, x_a = R x_b + p.
///
/// Name variables after the frames: `T_world_imu`, and T_world_cam = T_world_imu * T_imu_cam.
struct RigidTransform {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< rotation, frame b to frame a
  Eigen::Vector3d p = Eigen::Vector3d::Zero();      ///< origin of b in frame a [m]

  static RigidTransform from_quaternion(const Eigen::Vector3d& p, const Eigen::Quaterniond& q) {
    return {q.normalized().toRotationMatrix(), p};
  }

  [[nodiscard]] RigidTransform inverse() const { return {R.transpose(), -(R.transpose() * p)}; }
  [[nodiscard]] Eigen::Quaterniond quaternion() const { return Eigen::Quaterniond(R); }

  RigidTransform operator*(const RigidTransform& T_b_c) const {
    return {R * T_b_c.R, R * T_b_c.p + p};
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& x_b) const { return R * x_b + p; }
};

/// Pose a fraction of the way from T0 to T1 (0: T0, 1: T1): straight line and constant rotation
/// rate.
RigidTransform interpolate(const RigidTransform& T0, const RigidTransform& T1, double fraction);

}  // namespace topoloc

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"

#include <Eigen/Core>

namespace topoloc::matching {

/// Where the filter expects the IMU to be at the frame's time.
struct PosePrediction {
  RigidTransform T_world_imu;
  /// Covariance of (theta [rad], p [m]): R_true = R Exp(theta) in IMU axes, p in world axes.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// A map point as the current camera is expected to see it (f', eq_F_C_start_dash).
struct ProjectedPoint {
  bool visible = false;  ///< in front of the camera and finite; the rest is valid only then
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();
  /// Covariance of the pixel from the prediction's covariance [px^2], no image noise: J P J^T.
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

/// Projects world points with a predicted pose and its uncertainty.
class PredictedCamera {
 public:
  PredictedCamera(const PinholeCamera& camera, const RigidTransform& T_imu_cam,
                  const PosePrediction& prediction);

  [[nodiscard]] ProjectedPoint project(const Eigen::Vector3d& p_world) const;

  [[nodiscard]] const RigidTransform& T_world_cam() const { return T_world_cam_; }
  [[nodiscard]] const PinholeCamera& camera() const { return camera_; }

 private:
  PinholeCamera camera_;
  RigidTransform T_imu_world_;
  RigidTransform T_cam_imu_;
  RigidTransform T_world_cam_;
  Eigen::Matrix<double, 6, 6> covariance_;
};

/// d pixel / d q of an ideal pinhole camera at the camera-frame point q (Z > 0) [px/m].
Eigen::Matrix<double, 2, 3> projection_jacobian(const PinholeCamera& camera,
                                                const Eigen::Vector3d& q_cam);

/// Points closer than this to the camera's plane are taken as not visible [m].
inline constexpr double kMinDepth_m = 0.1;

}  // namespace topoloc::matching

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/predicted_camera.hpp"

#include "topoloc/geometry/so3.hpp"

namespace topoloc::matching {

PredictedCamera::PredictedCamera(const PinholeCamera& camera, const RigidTransform& T_imu_cam,
                                 const PosePrediction& prediction)
    : camera_(camera),
      T_imu_world_(prediction.T_world_imu.inverse()),
      T_cam_imu_(T_imu_cam.inverse()),
      T_world_cam_(prediction.T_world_imu * T_imu_cam),
      covariance_(prediction.covariance) {}

ProjectedPoint PredictedCamera::project(const Eigen::Vector3d& p_world) const {
  ProjectedPoint out;
  const Eigen::Vector3d p_imu = T_imu_world_ * p_world;
  const Eigen::Vector3d q = T_cam_imu_ * p_imu;
  if (!q.allFinite() || q.z() < kMinDepth_m) {
    return out;
  }
  out.visible = true;
  out.pixel_px = camera_.project(q);
  // The blocks of eq_hi_0: theta and p of the prediction's error, through the camera.
  Eigen::Matrix<double, 3, 6> dq;
  dq.leftCols<3>() = T_cam_imu_.R * so3::skew(p_imu);
  dq.rightCols<3>() = -T_cam_imu_.R * T_imu_world_.R;
  const Eigen::Matrix<double, 2, 6> J = projection_jacobian(camera_, q) * dq;
  out.covariance = J * covariance_ * J.transpose();
  return out;
}

Eigen::Matrix<double, 2, 3> projection_jacobian(const PinholeCamera& camera,
                                                const Eigen::Vector3d& q_cam) {
  const double inv_z = 1.0 / q_cam.z();
  Eigen::Matrix<double, 2, 3> J;
  J << camera.fx_px * inv_z, 0.0, -camera.fx_px * q_cam.x() * inv_z * inv_z,  //
      0.0, camera.fy_px * inv_z, -camera.fy_px * q_cam.y() * inv_z * inv_z;
  return J;
}

}  // namespace topoloc::matching

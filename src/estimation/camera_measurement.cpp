// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/camera_measurement.hpp"

#include "topoloc/geometry/so3.hpp"

namespace topoloc::estimation {

std::optional<ReprojectionLinearisation> linearise_reprojection(const NominalState& x,
                                                                const CameraModel& camera,
                                                                const Eigen::Vector2d& pixel_px,
                                                                const Eigen::Vector3d& p_world_m) {
  const Eigen::Vector3d p_imu = x.R_world_imu.transpose() * (p_world_m - x.p_world_imu);
  const Eigen::Vector3d q = camera.T_cam_imu * p_imu;
  if (!(q.z() > kMinDepth_m)) {
    return std::nullopt;
  }
  const PinholeCamera& k = camera.pinhole;
  const double inv_z = 1.0 / q.z();
  ReprojectionLinearisation out;
  out.z_px = k.project(q) - pixel_px;
  out.dz_dq << k.fx_px * inv_z, 0.0, -k.fx_px * q.x() * inv_z * inv_z,  //
      0.0, k.fy_px * inv_z, -k.fy_px * q.y() * inv_z * inv_z;
  const Eigen::Matrix<double, 2, 3> dz_dimu = out.dz_dq * camera.T_cam_imu.R;
  out.H.leftCols<3>().noalias() = dz_dimu * so3::skew(p_imu);
  out.H.rightCols<3>().noalias() = -dz_dimu * x.R_world_imu.transpose();
  return out;
}

Eigen::Matrix<double, 2, 6> node_pose_jacobian(const NominalState& x, const CameraModel& camera,
                                               const ReprojectionLinearisation& linearisation,
                                               const Eigen::Vector3d& p_world_m,
                                               const Eigen::Matrix3d& R_world_node,
                                               const Eigen::Vector3d& p_world_node_m) {
  const Eigen::Matrix<double, 2, 3> dz_dworld =
      linearisation.dz_dq * camera.T_cam_imu.R * x.R_world_imu.transpose();
  const Eigen::Vector3d p_node = R_world_node.transpose() * (p_world_m - p_world_node_m);
  Eigen::Matrix<double, 2, 6> H;
  H.leftCols<3>().noalias() = -dz_dworld * R_world_node * so3::skew(p_node);
  H.rightCols<3>() = dz_dworld;
  return H;
}

}  // namespace topoloc::estimation

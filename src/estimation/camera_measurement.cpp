// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/camera_measurement.hpp"

#include "topoloc/geometry/so3.hpp"

namespace topoloc::estimation {

std::optional<ReprojectionLinearisation> linearise_reprojection(const PinholeCamera& camera,
                                                                const RigidTransform& T_cam_world,
                                                                const Eigen::Vector2d& pixel_px,
                                                                const Eigen::Vector3d& p_world_m) {
  const Eigen::Vector3d q = T_cam_world * p_world_m;
  if (!(q.z() > kMinDepth_m)) {
    return std::nullopt;
  }
  // u = fx x / z + cx, v = fy y / z + cy, with dq = omega x q + tau
  const double x_z = q.x() / q.z();
  const double y_z = q.y() / q.z();
  const double fx_z = camera.fx_px / q.z();
  const double fy_z = camera.fy_px / q.z();
  ReprojectionLinearisation out;
  out.z_px = camera.project(q) - pixel_px;
  out.G << -camera.fx_px * x_z * y_z, camera.fx_px * (1.0 + x_z * x_z), -camera.fx_px * y_z,  //
      fx_z, 0.0, -fx_z * x_z,                                                                 //
      -camera.fy_px * (1.0 + y_z * y_z), camera.fy_px * x_z * y_z, camera.fy_px * x_z,        //
      0.0, fy_z, -fy_z * y_z;
  return out;
}

PoseCovariance body_motion(const RigidTransform& T_cam_body, const Eigen::Matrix3d& R_cam_world) {
  // dq = -[q - t]x R theta + R_cam_world dp, for q = R p_body + t
  PoseCovariance M = PoseCovariance::Zero();
  M.topLeftCorner<3, 3>() = T_cam_body.R;
  M.bottomLeftCorner<3, 3>() = so3::skew(T_cam_body.p) * T_cam_body.R;
  M.bottomRightCorner<3, 3>() = R_cam_world;
  return M;
}

RigidTransform camera_pose(const NominalState& x, const CameraModel& camera) {
  return camera.T_cam_imu * x.T_world_imu().inverse();
}

PoseCovariance vehicle_motion(const NominalState& x, const CameraModel& camera) {
  // Seen from the moving camera the world moves the other way.
  return -body_motion(camera.T_cam_imu, camera.T_cam_imu.R * x.R_world_imu.transpose());
}

}  // namespace topoloc::estimation

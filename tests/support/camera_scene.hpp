// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/camera_measurement.hpp"
#include "topoloc/estimation/measurements.hpp"

#include "support/random_states.hpp"

namespace topoloc::test {

/// Camera that looks along the IMU's x axis, 1 m ahead of it.
inline estimation::CameraModel forward_camera() {
  Eigen::Matrix3d R_cam_imu;
  R_cam_imu << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return {.pinhole = {.width_px = 640,
                      .height_px = 384,
                      .fx_px = 450.0,
                      .fy_px = 450.0,
                      .cx_px = 320.0,
                      .cy_px = 192.0},
          .T_cam_imu = {R_cam_imu, -(R_cam_imu * Eigen::Vector3d(1.0, 0.0, 0.3))}};
}

/// Fills a match set with points that the true pose sees, 4 to 30 m away, measured with normal
/// pixel noise; all hang on exact nodes.
inline void fill_matches(const RigidTransform& T_world_imu, const estimation::CameraModel& camera,
                         int count, double noise_px, Random& random, estimation::MapMatchSet& set) {
  set.node_count = 1;
  set.nodes[0].node_id = 7;
  set.nodes[0].R_world_cam = T_world_imu.R * camera.T_cam_imu.R.transpose();
  set.nodes[0].p_world_cam = T_world_imu.p + Eigen::Vector3d(0.5, -1.0, 0.2);
  set.nodes[0].covariance.setZero();
  set.match_count = count;
  const RigidTransform T_world_cam = T_world_imu * camera.T_cam_imu.inverse();
  for (int i = 0; i < count; ++i) {
    estimation::MapMatch& match = set.matches[static_cast<std::size_t>(i)];
    const Eigen::Vector2d pixel(random.uniform(0, 639), random.uniform(0, 383));
    match.p_world_m = T_world_cam * (camera.pinhole.ray(pixel) * random.uniform(4.0, 30.0));
    match.pixel_px = pixel + noise_px * random.normal_vector<2>();
    match.pixel_std_px = noise_px > 0.0 ? noise_px : 1.0;
    match.node_slot = 0;
  }
}

}  // namespace topoloc::test

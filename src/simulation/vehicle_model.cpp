// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/vehicle_model.hpp"

#include "topoloc/geometry/so3.hpp"
#include "topoloc/world/random.hpp"

#include "simulation/normal3.hpp"

#include <cmath>

namespace topoloc::simulation {
namespace {

constexpr double kDegree_rad = 0.017453292519943295;

/// Axes of a camera (x right, y down, z forward) in those of a vehicle, looking ahead.
Eigen::Matrix3d looking_ahead() {
  Eigen::Matrix3d R;
  R << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return R;
}

}  // namespace

Mounting nominal_mounting() {
  Mounting mounting;
  // Under the middle console.
  mounting.T_vehicle_imu = {so3::from_roll_pitch_yaw(Eigen::Vector3d(0.8, -1.2, 0.5) * kDegree_rad),
                            {1.1, 0.05, 0.45}};
  // Behind the windscreen, looking 2.5 degrees down.
  mounting.T_vehicle_cam = {
      so3::from_roll_pitch_yaw({0.0, 2.5 * kDegree_rad, 0.0}) * looking_ahead(), {1.7, 0.0, 1.3}};
  // On a rack on the roof, leaning forward a little so that the road ahead is seen well.
  mounting.T_vehicle_lidar = {so3::from_roll_pitch_yaw({0.0, 3.0 * kDegree_rad, 0.0}),
                              {0.9, 0.0, 2.0}};
  return mounting;
}

Mounting built_mounting(std::uint64_t key) {
  Mounting mounting = nominal_mounting();
  world::Random imu(world::key(key, {1}));
  mounting.T_vehicle_imu.R *= so3::exp(0.1 * kDegree_rad * normal3(imu));
  mounting.T_vehicle_imu.p += 0.003 * normal3(imu);
  world::Random cam(world::key(key, {2}));
  mounting.T_vehicle_cam.R *= so3::exp(0.03 * kDegree_rad * normal3(cam));
  mounting.T_vehicle_cam.p += 0.003 * normal3(cam);
  return mounting;
}

CameraCalibration camera_calibration(int width_px) {
  const double scale = width_px / 720.0;
  CameraCalibration calibration;
  calibration.pinhole = {.width_px = width_px,
                         .height_px = static_cast<int>(std::lround(450.0 * scale)),
                         .fx_px = 460.0 * scale,
                         .fy_px = 460.5 * scale,
                         .cx_px = 362.3 * scale,
                         .cy_px = 222.8 * scale};
  calibration.distortion = Distortion::kRadTan;
  calibration.coefficients = {-0.14, 0.03, 0.0004, -0.0003, 0.0};
  return calibration;
}

}  // namespace topoloc::simulation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"

#include <cstdint>

namespace topoloc::simulation {

/// The car. Frame `vehicle`: middle of the rear axle on the ground, x forward, y left, z up.
struct VehicleModel {
  double wheelbase_m = 2.7;
  double track_m = 1.55;
  double heave_hz = 1.4;  ///< natural frequencies of the body on its springs
  double pitch_hz = 1.6;
  double roll_hz = 1.7;
  double damping = 0.4;                ///< of the critical one
  double pitch_rad_per_mps2 = 0.0025;  ///< nose down when braking: 1.4 degrees a g
  double roll_rad_per_mps2 = 0.007;    ///< out of the curve: 4 degrees a g
};

/// Where its sensors sit.
struct Mounting {
  RigidTransform T_vehicle_imu;
  RigidTransform T_vehicle_cam;
  RigidTransform T_vehicle_lidar;
};

/// As the car's drawings say, and for the camera its calibration.
Mounting nominal_mounting();

/// As it was built: turned by about 0.1 degrees (IMU) and 0.03 degrees, 3 mm (camera) against
/// that. One car per `key`.
Mounting built_mounting(std::uint64_t key);

/// The camera's lens, for images of a width.
CameraCalibration camera_calibration(int width_px);

}  // namespace topoloc::simulation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/drive/drive.hpp"
#include "topoloc/evaluation/trajectory.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/refinement/registration.hpp"

namespace topoloc::refinement {

/// How far dead reckoning can be trusted from one keyframe to the next.
struct OdometryNoise {
  double rotation_rad_per_root_s = 0.0007;  ///< drift of each angle with the root of time
  double along = 0.01;                      ///< of the distance: wheel radius, slip
  double across = 0.005;                    ///< of the distance: sideways and up
  double floor_m = 0.005;
  double floor_rad = 0.0002;
};

/// Dead reckoning (wheel and IMU, no map) by the same estimator that drives: poses at its ticks.
/// `start_s` after the first inertial sample it starts at T_world_imu.
evaluation::Trajectory dead_reckon(const drive::Drive& drive, double start_s,
                                   const RigidTransform& T_world_imu);

/// Deviations (theta, t) of a motion that took `seconds`.
Vector6 motion_std(const RigidTransform& T_from_to, double seconds, const OdometryNoise& noise);

}  // namespace topoloc::refinement

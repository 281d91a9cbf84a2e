// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/drive/drive.hpp"
#include "topoloc/evaluation/trajectory.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/refinement/registration.hpp"

#include <vector>

namespace topoloc::refinement {

/// How far dead reckoning can be trusted from one keyframe to the next. The position part is not
/// the wheels' alone: the cloud was put together with poses that wander, too. Ways through a cloud
/// and ways by wheel and attitude differ by 0.6 % over 20 m on KITTI (tools/oxts_noise.py), which
/// is 0.027 m per root of a metre.
struct OdometryNoise {
  double rotation_rad_per_root_s = 0.0007;  ///< drift of each angle with the root of time
  double along_m_per_root_m = 0.027;
  double across_m_per_root_m = 0.027;  ///< sideways and up
  double floor_m = 0.005;
  double floor_rad = 0.0002;
};

/// Dead reckoning (wheel and IMU, no map), at the same times.
struct DeadReckoning {
  evaluation::Trajectory filtered;   ///< by the estimator that drives: knows which way is up
  std::vector<double> tilt_std_rad;  ///< of its roll and pitch
  /// The motion from pose to pose: what the filter mends of its attitude and position as it goes is
  /// none. It turns by the gyro alone, and moves sideways and up, and wherever it is slow, by the
  /// filter's velocity.
  evaluation::Trajectory motion;
};

/// `start_s` after the first inertial sample it starts at T_world_imu. Constant errors of the
/// inertial sensors are left in: they are the pose graph's to find.
DeadReckoning dead_reckon(const drive::Drive& drive, double start_s,
                          const RigidTransform& T_world_imu);

/// Deviations (theta, t) of a motion that took `seconds`.
Vector6 motion_std(const RigidTransform& T_from_to, double seconds, const OdometryNoise& noise);

}  // namespace topoloc::refinement

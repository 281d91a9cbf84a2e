// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/odometry.hpp"

#include "topoloc/localiser/batch.hpp"

#include <cmath>

namespace topoloc::refinement {

evaluation::Trajectory dead_reckon(const drive::Drive& drive, double start_s,
                                   const RigidTransform& T_world_imu) {
  localiser::BatchOptions options;
  options.start_s = start_s;
  options.initial_pose = T_world_imu;
  evaluation::Trajectory trajectory;
  localiser::BatchObserver observer;
  observer.estimate = [&](const estimation::Estimate& estimate) {
    if (trajectory.empty() || estimate.time_ns > trajectory.back().time_ns) {
      trajectory.push_back({estimate.time_ns, estimate.state.T_world_imu()});
    }
  };
  // Left to itself the filter would take what the no-slip assumption gets wrong in a turn for a
  // gyro bias, and turn away with it: biases are the pose graph's to find.
  drive::Drive steady = drive;
  steady.vehicle.estimator.initial.gyro_bias_radps = 0.0005;
  run_batch(steady, nullptr, nullptr, options, observer);
  return trajectory;
}

Vector6 motion_std(const RigidTransform& T_from_to, double seconds, const OdometryNoise& noise) {
  const double rotation = std::hypot(
      noise.floor_rad, noise.rotation_rad_per_root_s * std::sqrt(std::max(0.0, seconds)));
  const double way_m = T_from_to.p.norm();
  const double along_m = std::hypot(noise.floor_m, noise.along * way_m);
  const double across_m = std::hypot(noise.floor_m, noise.across * way_m);
  Vector6 std;
  std << rotation, rotation, rotation, along_m, across_m, across_m;
  return std;
}

}  // namespace topoloc::refinement

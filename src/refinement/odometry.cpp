// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/odometry.hpp"

#include "topoloc/localiser/batch.hpp"
#include "topoloc/refinement/gyro_integral.hpp"

#include "refinement/driven_motion.hpp"
#include "refinement/standing.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace topoloc::refinement {

namespace {

/// Takes off what is known of the biases where the vehicle stands: all of the gyro's, and the part
/// of the accelerometer's that makes gravity longer or shorter. (The rest may as well be a slope.)
void take_off_biases(const drive::Drive& drive, estimation::EstimatorConfig& config) {
  if (const auto mean = standing(drive)) {
    config.initial_gyro_bias_radps = mean->angular_rate_radps;
    const Eigen::Vector3d force = mean->specific_force_mps2 - config.initial_accel_bias_mps2;
    config.initial_accel_bias_mps2 += (force.norm() - config.gravity_mps2) * force.normalized();
  }
}

}  // namespace

DeadReckoning dead_reckon(const drive::Drive& drive, double start_s,
                          const RigidTransform& T_world_imu) {
  localiser::BatchOptions options;
  options.start_s = start_s;
  options.initial_pose = T_world_imu;
  DeadReckoning result;
  std::vector<Eigen::Vector3d> v_imu_mps;
  localiser::BatchObserver observer;
  observer.estimate = [&](const estimation::Estimate& estimate) {
    if (result.filtered.empty() || estimate.time_ns > result.filtered.back().time_ns) {
      const estimation::NominalState& x = estimate.state;
      result.filtered.push_back({estimate.time_ns, x.T_world_imu()});
      v_imu_mps.emplace_back(x.R_world_imu.transpose() * x.v_world_imu);
      result.tilt_std_rad.push_back(
          std::sqrt(estimate.P.diagonal().segment<2>(estimation::error_index::kTheta).maxCoeff()));
    }
  };
  // Left to itself the filter would take what the no-slip assumption gets wrong in a turn for a
  // gyro bias, and a wrong tilt for an accelerometer bias; held to none, it would sink or climb by
  // the upward part of the bias that there is.
  drive::Drive steady = drive;
  take_off_biases(drive, steady.vehicle.estimator);
  steady.vehicle.estimator.initial.gyro_bias_radps = 0.0005;
  steady.vehicle.estimator.initial.accel_bias_mps2 = 0.005;
  run_batch(steady, nullptr, nullptr, options, observer);
  const GyroIntegral gyro(drive.imu, steady.vehicle.estimator.initial_gyro_bias_radps);
  const Eigen::Matrix3d& R_vehicle_imu = drive.vehicle.estimator.models.speed.R_vehicle_imu;
  result.motion = driven_motion(result.filtered, v_imu_mps, R_vehicle_imu.transpose().col(0), gyro);
  return result;
}

Vector6 motion_std(const RigidTransform& T_from_to, double seconds, const OdometryNoise& noise) {
  const double rotation = std::hypot(
      noise.floor_rad, noise.rotation_rad_per_root_s * std::sqrt(std::max(0.0, seconds)));
  const double way_m = T_from_to.p.norm();
  const double along_m = std::hypot(noise.floor_m, noise.along_m_per_root_m * std::sqrt(way_m));
  const double across_m = std::hypot(noise.floor_m, noise.across_m_per_root_m * std::sqrt(way_m));
  Vector6 std;
  std << rotation, rotation, rotation, along_m, across_m, across_m;
  return std;
}

}  // namespace topoloc::refinement

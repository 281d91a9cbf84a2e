// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/odometry.hpp"

#include "topoloc/localiser/batch.hpp"
#include "topoloc/refinement/gyro_integral.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace topoloc::refinement {

namespace {

/// The way step by step, turned by the gyro. Forward it is that of the filter's positions; sideways
/// and up, and wherever the vehicle hardly moves, that of its velocities (in the IMU's axes): when
/// the filter finds its heading or tilt to be wrong, it shifts its position to where the way so far
/// must have led, which is no motion.
evaluation::Trajectory moved_on(const evaluation::Trajectory& filtered,
                                const std::vector<Eigen::Vector3d>& v_imu_mps,
                                const Eigen::Vector3d& forward_imu, const GyroIntegral& gyro) {
  constexpr double kSlow_mps = 0.5;
  evaluation::Trajectory result;
  for (std::size_t i = 0; i < filtered.size(); ++i) {
    if (i == 0) {
      result.push_back(filtered[0]);
      continue;
    }
    const double seconds = evaluation::kSecondsPerNs *
                           static_cast<double>(filtered[i].time_ns - filtered[i - 1].time_ns);
    RigidTransform step = filtered[i - 1].T_world_imu.inverse() * filtered[i].T_world_imu;
    step.R = gyro.between(filtered[i - 1].time_ns, filtered[i].time_ns);
    const Eigen::Vector3d driven = 0.5 * seconds * (v_imu_mps[i - 1] + step.R * v_imu_mps[i]);
    if (v_imu_mps[i].norm() < kSlow_mps) {
      step.p = driven;
    } else {
      step.p = driven + forward_imu * forward_imu.dot(step.p - driven);
    }
    result.push_back({filtered[i].time_ns, result.back().T_world_imu * step});
  }
  return result;
}

/// What the inertial sensors say while the wheels stand, on the average: their errors, and gravity.
struct Standing {
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();
};

/// When the wheels stand. Sensors read zero below some speed, and a vehicle nods as it sets off and
/// stops, which on the average looks like a bias: the second beside a motion is left out.
std::vector<std::pair<std::int64_t, std::int64_t>> standing_intervals(const drive::Drive& drive) {
  constexpr std::int64_t kNods_ns = 1'000'000'000;
  const double most_mps = drive.vehicle.estimator.models.standstill.max_speed_mps;
  std::vector<std::pair<std::int64_t, std::int64_t>> intervals;
  const std::vector<estimation::SpeedSample>& speeds = drive.speed;
  for (std::size_t k = 0; k < speeds.size();) {
    if (std::abs(speeds[k].speed_mps) > most_mps) {
      ++k;
      continue;
    }
    const std::size_t first = k;
    while (k < speeds.size() && std::abs(speeds[k].speed_mps) <= most_mps) {
      ++k;
    }
    const std::int64_t from_ns = speeds[first].time_ns + (first > 0 ? kNods_ns : 0);
    const std::int64_t to_ns = speeds[k - 1].time_ns - (k < speeds.size() ? kNods_ns : 0);
    if (from_ns < to_ns) {
      intervals.emplace_back(from_ns, to_ns);
    }
  }
  return intervals;
}

/// Nothing where they stand for less than half a second in all.
std::optional<Standing> standing(const drive::Drive& drive) {
  constexpr double kLeast_s = 0.5;
  Standing sum;
  double samples = 0.0;
  double seconds = 0.0;
  auto sample = drive.imu.begin();
  for (const auto& [from_ns, to_ns] : standing_intervals(drive)) {
    seconds += evaluation::kSecondsPerNs * static_cast<double>(to_ns - from_ns);
    for (; sample != drive.imu.end() && sample->time_ns < to_ns; ++sample) {
      if (sample->time_ns >= from_ns) {
        sum.specific_force_mps2 += sample->specific_force_mps2;
        sum.angular_rate_radps += sample->angular_rate_radps;
        samples += 1.0;
      }
    }
  }
  if (seconds < kLeast_s || samples == 0.0) {
    return std::nullopt;
  }
  return Standing{sum.specific_force_mps2 / samples, sum.angular_rate_radps / samples};
}

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
  result.motion = moved_on(result.filtered, v_imu_mps, R_vehicle_imu.transpose().col(0), gyro);
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

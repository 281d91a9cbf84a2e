// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/propagation.hpp"

#include "support/camera_scene.hpp"

#include <vector>

namespace topoloc::test {

/// Landmark-level world: a car on a winding, hilly road that starts from rest and stops twice, its
/// IMU, and points along the road.
///
/// The pose is a closed formula of time; velocity, specific force and rate are its derivatives by
/// central differences (errors below 1e-6), so that nothing here integrates as the filter does. The
/// velocity of the rear axle lies exactly along the car's x axis: true non-holonomic motion.
class LandmarkWorld {
 public:
  struct Truth {
    RigidTransform T_world_imu;
    Eigen::Vector3d v_world_imu;
    Eigen::Vector3d accel_world;
    Eigen::Vector3d rate_imu;
    double speed_mps;  ///< of the rear axle, along the car's x axis
  };

  explicit LandmarkWorld(std::uint64_t seed) {
    Random random(seed);
    for (double x = -10.0; x < 350.0; x += 0.25) {
      const double side = random.uniform(-20.0, 20.0);
      landmarks_.push_back(road(x) + Eigen::Vector3d(0.0, side, random.uniform(-1.0, 6.0)));
    }
  }

  [[nodiscard]] Truth at(double t) const {
    constexpr double h = 1e-3;
    const RigidTransform T = imu_pose(t);
    const RigidTransform before = imu_pose(t - h);
    const RigidTransform after = imu_pose(t + h);
    return {.T_world_imu = T,
            .v_world_imu = (after.p - before.p) / (2.0 * h),
            .accel_world = (after.p - 2.0 * T.p + before.p) / (h * h),
            .rate_imu = so3::log(before.R.transpose() * after.R) / (2.0 * h),
            .speed_mps = (axle_position(t + h) - axle_position(t - h)).norm() / (2.0 * h)};
  }

  /// Fills a set with up to `count` landmarks that the camera sees 3 to 40 m away, the
  /// first along the road.
  void observe(const RigidTransform& T_world_imu, int count, double noise_px, Random& random,
               estimation::MapMatchSet& set) const {
    const RigidTransform T_cam_world = camera.T_cam_imu * T_world_imu.inverse();
    set.match_count = 0;
    for (const Eigen::Vector3d& landmark : landmarks_) {
      const Eigen::Vector3d q = T_cam_world * landmark;
      if (q.z() < 3.0 || q.z() > 40.0 || set.match_count == count) {
        continue;
      }
      const Eigen::Vector2d pixel = camera.pinhole.project(q);
      if (camera.pinhole.contains(pixel)) {
        set.matches[static_cast<std::size_t>(set.match_count++)] = {
            .pixel_px = pixel + noise_px * random.normal_vector<2>(),
            .p_world_m = landmark,
            .pixel_std_px = noise_px,
            .node_slot = 0};
      }
    }
  }

  const estimation::CameraModel camera = forward_camera();
  /// Rear axle in IMU axes, and the IMU's mounting (x forward, y left, z up but for a few degrees).
  const Eigen::Vector3d wheel_reference_imu_m{-1.2, 0.1, -0.6};
  const Eigen::Matrix3d R_vehicle_imu = so3::exp({0.02, -0.03, 0.05});

 private:
  /// Way along the road's x axis: 0 to 16 m/s and back to rest every ten seconds.
  static double way(double t) {
    constexpr double w = 0.6283185307179586;
    return 8.0 * (t - std::sin(w * t) / w);
  }
  static Eigen::Vector3d road(double x) {
    return {x, 12.0 * std::sin(x / 25.0), 2.0 * std::sin(x / 40.0)};
  }
  static Eigen::Vector3d axle_position(double t) { return road(way(t)); }
  [[nodiscard]] RigidTransform imu_pose(double t) const {
    const double x = way(t);
    const Eigen::Vector3d forward =
        Eigen::Vector3d(1.0, 12.0 / 25.0 * std::cos(x / 25.0), 2.0 / 40.0 * std::cos(x / 40.0))
            .normalized();
    const Eigen::Vector3d left = Eigen::Vector3d::UnitZ().cross(forward).normalized();
    Eigen::Matrix3d R_world_vehicle;
    R_world_vehicle << forward, left, forward.cross(left);
    const Eigen::Matrix3d R = R_world_vehicle * R_vehicle_imu;
    return {R, axle_position(t) - R * wheel_reference_imu_m};
  }

  std::vector<Eigen::Vector3d> landmarks_;
};

/// Inertial sensor whose noise is exactly as the densities say; the biases walk.
class ImuSimulator {
 public:
  ImuSimulator(const estimation::ImuNoise& noise, double rate_hz, const Eigen::Vector3d& accel_bias,
               const Eigen::Vector3d& gyro_bias)
      : accel_bias_mps2(accel_bias), gyro_bias_radps(gyro_bias), noise_(noise), rate_hz_(rate_hz) {}

  estimation::InertialInput sample(const LandmarkWorld::Truth& truth,
                                   const Eigen::Vector3d& gravity_mps2, Random& random) {
    const double root_rate = std::sqrt(rate_hz_);
    accel_bias_mps2 += noise_.accel_random_walk / root_rate * random.normal_vector<3>();
    gyro_bias_radps += noise_.gyro_random_walk / root_rate * random.normal_vector<3>();
    return {
        .specific_force_mps2 =
            truth.T_world_imu.R.transpose() * (truth.accel_world - gravity_mps2) + accel_bias_mps2 +
            noise_.accel_noise_density * root_rate * random.normal_vector<3>(),
        .angular_rate_radps = truth.rate_imu + gyro_bias_radps +
                              noise_.gyro_noise_density * root_rate * random.normal_vector<3>()};
  }

  Eigen::Vector3d accel_bias_mps2;
  Eigen::Vector3d gyro_bias_radps;

 private:
  estimation::ImuNoise noise_;
  double rate_hz_;
};

}  // namespace topoloc::test

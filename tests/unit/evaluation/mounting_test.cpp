// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/mounting.hpp"

#include "topoloc/geometry/so3.hpp"

#include <cmath>
#include <random>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::evaluation {
namespace {

/// What a synthetic drive does.
struct Drive {
  Eigen::Vector3d rpy_rad{0.0, 0.02, -0.03};
  Eigen::Vector3d lever_m{0.8, -0.4, -0.6};  ///< in the IMU frame
  double wheel_scale = 0.99;
  double yaw_rate_radps = 0.15;  ///< amplitude; 0: straight
  double roll_rate_radps = 0.05;
  double noise_mps = 0.02;
  double outlier_share = 0.0;
  unsigned seed = 1;
};

/// Samples at 20 Hz whose point `lever_m` moves straight ahead in vehicle axes.
std::vector<MotionSample> samples_of(const Drive& drive, int count = 2400) {
  const Eigen::Matrix3d R_vehicle_imu = so3::exp({0, 0, drive.rpy_rad.z()}) *
                                        so3::exp({0, drive.rpy_rad.y(), 0}) *
                                        so3::exp({drive.rpy_rad.x(), 0, 0});
  std::mt19937 random(drive.seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::vector<MotionSample> samples;
  for (int i = 0; i < count; ++i) {
    const double t = 0.05 * i;
    const double speed = 9.0 + 3.0 * std::sin(0.11 * t);
    const Eigen::Vector3d rate_vehicle(drive.roll_rate_radps * std::sin(3.0 * t),
                                       0.03 * std::sin(2.3 * t),
                                       drive.yaw_rate_radps * std::sin(0.4 * t));
    MotionSample sample;
    sample.time_ns = i * 50'000'000LL;
    sample.rate_imu_radps = R_vehicle_imu.transpose() * rate_vehicle;
    sample.velocity_imu_mps = R_vehicle_imu.transpose() * Eigen::Vector3d(speed, 0, 0) -
                              sample.rate_imu_radps.cross(drive.lever_m);
    sample.forward_acceleration_mps2 = 0.33 * std::cos(0.11 * t);
    sample.wheel_speed_mps = speed / drive.wheel_scale + drive.noise_mps * normal(random);
    for (double& v : sample.velocity_imu_mps) {
      v += drive.noise_mps * normal(random);
    }
    if (uniform(random) < drive.outlier_share) {
      sample.velocity_imu_mps.y() += 3.0;
    }
    samples.push_back(sample);
  }
  return samples;
}

/// Within four of its own standard deviations, and the deviation small enough to mean something.
void expect_recovered(const Parameter& parameter, double truth, double max_std) {
  EXPECT_TRUE(parameter.observable);
  EXPECT_LT(parameter.std, max_std);
  EXPECT_NEAR(parameter.value, truth, 4.0 * parameter.std);
}

TEST(Mounting, IsRecoveredWithinItsStatedDeviation) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Drive drive;
    drive.seed = seed;
    const MountingEstimate e = estimate_mounting(samples_of(drive));
    ASSERT_EQ(e.verdict, MountingVerdict::kOk);
    expect_recovered(e.pitch_rad, drive.rpy_rad.y(), 1e-3);
    expect_recovered(e.yaw_rad, drive.rpy_rad.z(), 1e-3);
    expect_recovered(e.wheel_scale, drive.wheel_scale, 1e-3);
    const Eigen::Vector3d lever_vehicle =
        so3::exp({0, 0, drive.rpy_rad.z()}) * so3::exp({0, drive.rpy_rad.y(), 0}) * drive.lever_m;
    expect_recovered(e.lever_x_m, lever_vehicle.x(), 0.05);
    expect_recovered(e.lever_y_m, lever_vehicle.y(), 0.05);
    expect_recovered(e.lever_z_m, lever_vehicle.z(), 0.15);
    EXPECT_NEAR(e.lateral_std_mps, drive.noise_mps, 0.3 * drive.noise_mps);
    EXPECT_LT((e.mounting.wheel_reference_imu_m - drive.lever_m).norm(), 0.15);
    EXPECT_LT((e.mounting.rotation_vehicle_imu_rpy_rad - drive.rpy_rad).norm(), 1e-3);
  }
}

TEST(Mounting, LargeAnglesAndTheGivenRollAreHandled) {
  Drive drive;
  drive.rpy_rad = {0.1, -0.25, 0.35};
  MountingOptions options;
  options.given.rotation_vehicle_imu_rpy_rad.x() = 0.1;
  const MountingEstimate e = estimate_mounting(samples_of(drive), options);
  ASSERT_EQ(e.verdict, MountingVerdict::kOk);
  EXPECT_NEAR(e.pitch_rad.value, -0.25, 2e-3);
  EXPECT_NEAR(e.yaw_rad.value, 0.35, 2e-3);
  EXPECT_EQ(e.mounting.rotation_vehicle_imu_rpy_rad.x(), 0.1);
}

TEST(Mounting, StraightDriveLeavesTheLeverArmAsGiven) {
  Drive drive;
  drive.yaw_rate_radps = 0.0;
  drive.roll_rate_radps = 0.0;
  MountingOptions options;
  options.given.wheel_reference_imu_m = {1.5, 0.25, -0.5};
  const MountingEstimate e = estimate_mounting(samples_of(drive), options);
  ASSERT_EQ(e.verdict, MountingVerdict::kOk);
  EXPECT_FALSE(e.lever_x_m.observable);
  EXPECT_FALSE(e.lever_y_m.observable);
  EXPECT_FALSE(e.lever_z_m.observable);
  EXPECT_GT(e.lever_x_m.std, 1.0);
  EXPECT_TRUE(e.mounting.wheel_reference_imu_m.isApprox(Eigen::Vector3d(1.5, 0.25, -0.5), 1e-9));
  expect_recovered(e.yaw_rad, drive.rpy_rad.z(), 1e-3);
  expect_recovered(e.pitch_rad, drive.rpy_rad.y(), 1e-3);
}

TEST(Mounting, OutliersDoNotMatter) {
  Drive drive;
  drive.outlier_share = 0.15;
  const MountingEstimate e = estimate_mounting(samples_of(drive));
  ASSERT_EQ(e.verdict, MountingVerdict::kOk);
  EXPECT_NEAR(e.yaw_rad.value, drive.rpy_rad.z(), 2e-3);
}

TEST(Mounting, DelayedWheelSpeedsAreFound) {
  const Drive drive;
  std::vector<MotionSample> samples = samples_of(drive);
  for (MotionSample& sample : samples) {
    sample.wheel_speed_mps = *sample.wheel_speed_mps - 0.1 * sample.forward_acceleration_mps2;
  }
  const MountingEstimate e = estimate_mounting(samples);
  EXPECT_TRUE(e.wheel_delay_s.observable);
  EXPECT_NEAR(e.wheel_delay_s.value, 0.1 * drive.wheel_scale, 0.01);
}

TEST(Mounting, TyreSlipIsToldFromTheLeverArm) {
  Drive drive;
  std::vector<MotionSample> samples = samples_of(drive);
  constexpr double kSlip = 0.005;
  for (MotionSample& sample : samples) {
    const double v = sample.velocity_imu_mps.x();
    sample.velocity_imu_mps.y() -= kSlip * v * v * sample.rate_imu_radps.z();
  }
  const MountingEstimate e = estimate_mounting(samples);
  expect_recovered(e.slip_s2pm, kSlip, 0.001);
  EXPECT_NEAR(e.lever_x_without_slip_m.value, drive.lever_m.x(), 0.1);
  EXPECT_GT(e.lever_x_m.value, drive.lever_m.x() + 0.3);
}

TEST(Mounting, WithoutWheelSpeedsTheScaleStays) {
  std::vector<MotionSample> samples = samples_of({});
  for (MotionSample& sample : samples) {
    sample.wheel_speed_mps.reset();
  }
  MountingOptions options;
  options.given.wheel_scale = 1.25;
  const MountingEstimate e = estimate_mounting(samples, options);
  EXPECT_EQ(e.verdict, MountingVerdict::kOk);
  EXPECT_FALSE(e.wheel_scale.observable);
  EXPECT_EQ(e.mounting.wheel_scale, 1.25);
}

TEST(Mounting, RefusesTooLittleMotionAndContradictingReferences) {
  EXPECT_EQ(estimate_mounting({}).verdict, MountingVerdict::kTooFewSamples);
  EXPECT_EQ(estimate_mounting(samples_of({}, 40)).verdict, MountingVerdict::kTooFewSamples);
  MountingOptions fast;
  fast.min_speed_mps = 30.0;
  const MountingEstimate slow = estimate_mounting(samples_of({}), fast);
  EXPECT_EQ(slow.verdict, MountingVerdict::kTooFewSamples);
  EXPECT_EQ(slow.too_slow, 2400u);
  Drive wild;
  wild.noise_mps = 2.0;
  EXPECT_EQ(estimate_mounting(samples_of(wild)).verdict, MountingVerdict::kResidualsTooLarge);
}

TEST(Differentiate, GivesBodyVelocityRateAndAcceleration) {
  Trajectory circle;  // 5 m/s + 0.5 m/s^2 t on a circle of 20 m, IMU nose along the tangent
  for (int i = 0; i < 100; ++i) {
    const double t = 0.04 * i;
    const double angle = (5.0 * t + 0.25 * t * t) / 20.0;
    circle.push_back({i * 40'000'000LL,
                      {so3::exp({0, 0, angle + M_PI / 2.0}),
                       {20.0 * std::cos(angle), 20.0 * std::sin(angle), 0.0}}});
  }
  const auto samples = differentiate(circle, 0.1);
  ASSERT_EQ(samples.size(), 96u);
  for (const MotionSample& sample : samples) {
    const double speed = 5.0 + 0.5 * static_cast<double>(sample.time_ns) * 1e-9;
    EXPECT_LT((sample.velocity_imu_mps - Eigen::Vector3d(speed, 0, 0)).norm(), 2e-3);
    EXPECT_LT((sample.rate_imu_radps - Eigen::Vector3d(0, 0, speed / 20.0)).norm(), 1e-4);
    EXPECT_NEAR(sample.forward_acceleration_mps2, 0.5, 5e-3);
  }
}

TEST(Differentiate, LeavesOutPosesWithoutNeighbours) {
  Trajectory sparse;
  for (int i = 0; i < 10; ++i) {
    sparse.push_back({i * 1'000'000'000LL, {}});
  }
  EXPECT_TRUE(differentiate(sparse, 0.25).empty());
  EXPECT_TRUE(differentiate({}, 0.25).empty());
}

TEST(WithMounting, ReplacesTheKeysAndKeepsEverythingElse) {
  const std::string before =
      "# my car\nformat: 1\nvehicle:\n  wheel_scale: 1.0  # factory\n  # lever\n"
      "  wheel_reference_imu_m: [0, 0, 0]\n\ncamera:\n  wheel_scale: 7\n";
  const Mounting mounting{{0.0, 0.01, -0.005}, {0.4, 0.0, -0.9}, 0.9912};
  const std::string after = with_mounting(before, mounting);
  EXPECT_EQ(after,
            "# my car\nformat: 1\nvehicle:\n"
            "  rotation_vehicle_imu_rpy_rad: [0.000000, 0.010000, -0.005000]\n"
            "  wheel_scale: 0.99120  # factory\n  # lever\n"
            "  wheel_reference_imu_m: [0.4000, 0.0000, -0.9000]\n\ncamera:\n  wheel_scale: 7\n");
  EXPECT_EQ(with_mounting(after, mounting), after);
}

TEST(WithMounting, AddsTheSectionAndRefusesOtherStyles) {
  EXPECT_THAT(with_mounting("format: 1\n", {}), testing::StartsWith("format: 1\nvehicle:\n  rot"));
  EXPECT_THROW(with_mounting("vehicle: {wheel_scale: 1}\n", {}), std::runtime_error);
  EXPECT_THROW(with_mounting("vehicle:\n  wheel_reference_imu_m:\n    - 1\n", {}),
               std::runtime_error);
  EXPECT_THROW(with_mounting("vehicle:\n  wheel_reference_imu_m: [1,\n    2, 3]\n", {}),
               std::runtime_error);
}

}  // namespace
}  // namespace topoloc::evaluation

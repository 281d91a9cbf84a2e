// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/estimator.hpp"

#include <gtest/gtest.h>

namespace topoloc::estimation {
namespace {

TEST(Estimator, StartsWithTheTurnOnBiasesThatItIsTold) {
  EstimatorConfig config;
  config.initial_gyro_bias_radps = {0.01, -0.02, 0.07};
  config.initial_accel_bias_mps2 = {0.1, 0.2, -0.3};
  config.models.speed.wheel_reference_imu_m = {-2.0, 0.0, -1.0};
  Estimator estimator(config);

  // Straight on: all that the gyroscope measures is its bias.
  const ImuSample imu{.time_ns = 1'000'000'000,
                      .specific_force_mps2 = {0.1, 0.2, 9.51},
                      .angular_rate_radps = config.initial_gyro_bias_radps};
  const SpeedSample speed{.time_ns = 1'000'000'000, .speed_mps = 10.0};
  const Estimate& estimate = estimator.tick(
      imu.time_ns, {.imu = {&imu, 1},
                    .speed = {&speed, 1},
                    .matches = {},
                    .initial_pose = InitialPose{.time_ns = imu.time_ns, .T_world_imu = {}}});
  ASSERT_NE(estimate.mode, Mode::kUninitialised);
  EXPECT_EQ(estimate.state.gyro_bias_radps, config.initial_gyro_bias_radps);
  EXPECT_EQ(estimate.state.accel_bias_mps2, config.initial_accel_bias_mps2);
  EXPECT_TRUE(estimate.state.v_world_imu.isApprox(Eigen::Vector3d(10.0, 0.0, 0.0)))
      << "no lever arm speed from a rate that is not there";
}

}  // namespace
}  // namespace topoloc::estimation

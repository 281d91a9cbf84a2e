// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/gyro_integral.hpp"

#include "topoloc/geometry/so3.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

constexpr std::int64_t kStep_ns = 100'000'000;

/// Turns about one axis, ever faster: 1 rad/s^2.
std::vector<estimation::ImuSample> speeding_up(const Eigen::Vector3d& bias_radps) {
  std::vector<estimation::ImuSample> samples;
  for (int i = 0; i <= 10; ++i) {
    samples.push_back(
        {i * kStep_ns, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.0, 0.0, 0.1 * i) + bias_radps});
  }
  return samples;
}

TEST(GyroIntegral, TurnsByTheIntegralOfTheRate) {
  const Eigen::Vector3d bias_radps(0.01, -0.02, 0.03);
  const auto samples = speeding_up(bias_radps);
  const GyroIntegral gyro(samples, bias_radps);
  // Between the samples, too: half of 0.77^2 less half of 0.21^2.
  const Eigen::Matrix3d R = gyro.between(210'000'000, 770'000'000);
  EXPECT_LT((so3::log(R) - Eigen::Vector3d(0.0, 0.0, 0.2744)).norm(), 1e-9);
}

TEST(GyroIntegral, TurnsBackInTime) {
  const auto samples = speeding_up(Eigen::Vector3d::Zero());
  const GyroIntegral gyro(samples, Eigen::Vector3d::Zero());
  const Eigen::Matrix3d there_and_back =
      gyro.between(0, 8 * kStep_ns) * gyro.between(8 * kStep_ns, 0);
  EXPECT_LT((there_and_back - Eigen::Matrix3d::Identity()).norm(), 1e-12);
}

TEST(GyroIntegral, StandsStillOutsideItsSamples) {
  const auto samples = speeding_up(Eigen::Vector3d::Zero());
  const GyroIntegral gyro(samples, Eigen::Vector3d::Zero());
  EXPECT_EQ(gyro.between(-5 * kStep_ns, 0), Eigen::Matrix3d::Identity());
  EXPECT_EQ(gyro.between(0, 10 * kStep_ns), gyro.between(0, 99 * kStep_ns));
  EXPECT_EQ(GyroIntegral({}, Eigen::Vector3d::Zero()).between(0, kStep_ns),
            Eigen::Matrix3d::Identity());
}

}  // namespace
}  // namespace topoloc::refinement

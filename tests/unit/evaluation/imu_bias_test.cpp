// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/imu_bias.hpp"

#include "topoloc/geometry/so3.hpp"

#include <cmath>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::evaluation {
namespace {

constexpr double kGravity_mps2 = 9.81;
const Eigen::Vector3d kGyroBias(0.01, -0.03, 0.07);
const Eigen::Vector3d kAccelBias(-0.2, 0.1, 0.3);

/// Ten seconds of a bend uphill with growing speed: reference at 20 Hz, IMU at 100 Hz.
class ImuBiasTest : public ::testing::Test {
 protected:
  ImuBiasTest() {
    for (int i = 0; i <= 200; ++i) {
      reference_.push_back({i * 50'000'000LL, {attitude(0.05 * i), position(0.05 * i)}});
    }
    for (int i = 0; i <= 1000; ++i) {
      const double t = 0.01 * i;
      const double h = 1e-3;
      const Eigen::Vector3d acceleration =
          (position(t + h) - 2.0 * position(t) + position(t - h)) / (h * h);
      const Eigen::Vector3d rate =
          so3::log(attitude(t - h).transpose() * attitude(t + h)) / (2.0 * h);
      imu_.push_back(
          {.time_ns = i * 10'000'000LL,
           .specific_force_mps2 =
               attitude(t).transpose() * (acceleration + Eigen::Vector3d(0, 0, kGravity_mps2)) +
               kAccelBias,
           .angular_rate_radps = rate + kGyroBias});
    }
  }

  static Eigen::Matrix3d attitude(double t) {
    return so3::exp({0, 0, 0.1 * t}) * so3::exp({0, -0.05, 0}) *
           so3::exp({0.02 * std::sin(2.0 * t), 0, 0});
  }
  static Eigen::Vector3d position(double t) {  // speed 8 + t along a circle's tangent
    return {80.0 * std::sin(0.1 * t) + 5.0 * t * t / 10.0, 80.0 * (1.0 - std::cos(0.1 * t)),
            0.4 * t};
  }

  Trajectory reference_;
  std::vector<estimation::ImuSample> imu_;
};

TEST_F(ImuBiasTest, FindsBothBiasesInABend) {
  const ImuBias bias = estimate_imu_bias(reference_, imu_, kGravity_mps2);
  EXPECT_GE(bias.windows, 8U);
  EXPECT_TRUE(bias.gyro_radps.isApprox(kGyroBias, 0.02)) << bias.gyro_radps.transpose();
  EXPECT_TRUE(bias.accel_mps2.isApprox(kAccelBias, 0.05)) << bias.accel_mps2.transpose();
  EXPECT_LT(bias.gyro_std_radps.maxCoeff(), 0.01);
}

TEST_F(ImuBiasTest, TooShortAReferenceGivesNothing) {
  reference_.resize(60);  // 3 s, of which half a second is lost to differentiation
  const ImuBias bias = estimate_imu_bias(reference_, imu_, kGravity_mps2);
  EXPECT_EQ(bias.windows, 0U);
  EXPECT_TRUE(bias.gyro_radps.isZero());
}

TEST_F(ImuBiasTest, WindowsWithoutInertialSamplesAreLeftOut) {
  imu_.resize(500);
  const ImuBias bias = estimate_imu_bias(reference_, imu_, kGravity_mps2);
  EXPECT_EQ(bias.windows, 5U);  // the fifth holds three quarters of its samples
  EXPECT_NEAR(bias.gyro_radps.z(), kGyroBias.z(), 2e-3);
}

TEST(WithImuBias, ReplacesOrAddsTheKeysAndKeepsTheRest) {
  ImuBias bias;
  bias.gyro_radps = kGyroBias;
  bias.accel_mps2 = kAccelBias;
  bias.gyro_std_radps = {1e-4, 2.5e-4, 1e-4};
  bias.accel_std_mps2 = {0.01, 0.02, 0.03};
  EXPECT_EQ(with_imu_bias("imu:  # phone\n  calibration: imu.yaml\n"
                          "  gyro_bias_radps: [0, 0, 0]  # none yet\nname: x\n",
                          bias),
            "imu:  # phone\n  accel_bias_mps2: [-0.20000, 0.10000, 0.30000]\n"
            "  gyro_bias_std_radps: 0.00025\n  accel_bias_std_mps2: 0.03\n"
            "  calibration: imu.yaml\n"
            "  gyro_bias_radps: [0.010000, -0.030000, 0.070000]  # none yet\nname: x\n");
}

}  // namespace
}  // namespace topoloc::evaluation

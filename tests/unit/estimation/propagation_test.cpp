// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/propagation.hpp"

#include "support/random_states.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace topoloc::estimation {
namespace {

using namespace error_index;
using Eigen::Vector3d;
using test::Random;

constexpr ImuNoise kNoise{.accel_noise_density = 0.03,
                          .gyro_noise_density = 2e-3,
                          .accel_random_walk = 5e-3,
                          .gyro_random_walk = 4e-4};

TEST(Propagation, StandingVehicleStays) {
  NominalState x;
  x.R_world_imu = so3::exp({0.1, -0.2, 2.0});
  x.accel_bias_mps2 = {0.1, 0.2, -0.1};
  x.gyro_bias_radps = {0.01, -0.02, 0.005};
  const InertialInput u{
      .specific_force_mps2 = x.R_world_imu.transpose() * -x.gravity_mps2 + x.accel_bias_mps2,
      .angular_rate_radps = x.gyro_bias_radps};
  NominalState y = x;
  for (int i = 0; i < 2000; ++i) {
    y = propagate_state(y, u, 0.005);
  }
  EXPECT_LT(boxminus(y, x).norm(), 1e-10);
}

TEST(Propagation, FreeFallIsExact) {
  const InertialInput u{.specific_force_mps2 = Vector3d::Zero(),
                        .angular_rate_radps = Vector3d::Zero()};
  const NominalState y = propagate_state(NominalState{}, u, 2.0);
  EXPECT_NEAR(y.v_world_imu.z(), -19.62, 1e-12);
  EXPECT_NEAR(y.p_world_imu.z(), -19.62, 1e-12);
}

/// Constant speed on a circle on level ground, driven counter-clockwise; gives the position error
/// after one lap of 10 s with the given step, the acceleration taken at the middle of each step.
double circle_error_m(double dt_s) {
  constexpr double kRate = 2.0 * 3.14159265358979323846 / 10.0;
  constexpr double kSpeed = 10.0;
  NominalState x;
  x.v_world_imu = {kSpeed, 0.0, 0.0};
  const NominalState start = x;
  // Body axes turn with the car: the specific force is constant in them.
  const InertialInput u{.specific_force_mps2 = {0.0, kSpeed * kRate, 9.81},
                        .angular_rate_radps = {0.0, 0.0, kRate}};
  const int steps = static_cast<int>(std::lround(10.0 / dt_s));
  double largest = 0.0;
  for (int i = 1; i <= steps; ++i) {
    x = propagate_state(x, u, dt_s);
    const double angle = kRate * dt_s * i;
    const Vector3d truth(kSpeed / kRate * std::sin(angle), kSpeed / kRate * (1 - std::cos(angle)),
                         0.0);
    largest = std::max(largest, (x.p_world_imu - truth).norm());
  }
  EXPECT_LT((x.R_world_imu - start.R_world_imu).norm(), 1e-11);
  return largest;
}

// Rotation is exact for a constant rate; the specific force is turned with the attitude of
// mid-step, so that the error falls with the square of the step.
TEST(Propagation, ReproducesACircleWithSecondOrderConvergence) {
  const double coarse = circle_error_m(0.02);
  const double middle = circle_error_m(0.01);
  const double fine = circle_error_m(0.005);
  EXPECT_LT(fine, 1e-3);
  EXPECT_GT(std::log2(coarse / middle), 1.9);
  EXPECT_GT(std::log2(middle / fine), 1.9);
}

TEST(Propagation, CovarianceEqualsTheDenseProduct) {
  Random random(1);
  for (int trial = 0; trial < 10; ++trial) {
    const NominalState x = test::random_state(random);
    const InertialInput u{.specific_force_mps2 = 10.0 * random.normal_vector<3>(),
                          .angular_rate_radps = random.normal_vector<3>()};
    const Covariance P = test::random_covariance(random, 0.5);
    const Covariance F = transition_matrix(x, u, 0.01);
    Covariance fast = P;
    propagate_covariance(x, u, kNoise, 0.01, fast);
    EXPECT_LT((fast - (F * P * F.transpose() + process_noise(kNoise, 0.01))).norm(), 1e-13);
    EXPECT_EQ(fast, fast.transpose().eval());
  }
}

// Truth: white acceleration noise integrated in 1000 small steps, Q <- A Q A^T + density^2 dt.
TEST(Propagation, ProcessNoiseEqualsTheIntegralOfTheDensities) {
  constexpr double kDt = 0.2;
  constexpr int kSteps = 20000;
  constexpr double h = kDt / kSteps;
  Eigen::Matrix2d A;
  A << 1.0, h, 0.0, 1.0;
  Eigen::Matrix2d Q = Eigen::Matrix2d::Zero();
  const double density_sq = kNoise.accel_noise_density * kNoise.accel_noise_density;
  for (int i = 0; i < kSteps; ++i) {
    Q = A * Q * A.transpose();
    Q(1, 1) += density_sq * h;
  }
  const Covariance analytic = process_noise(kNoise, kDt);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(analytic(kP + i, kP + i) / Q(0, 0), 1.0, 1e-3);
    EXPECT_NEAR(analytic(kP + i, kV + i) / Q(0, 1), 1.0, 1e-3);
    EXPECT_NEAR(analytic(kV + i, kP + i) / Q(0, 1), 1.0, 1e-3);
    EXPECT_NEAR(analytic(kV + i, kV + i) / Q(1, 1), 1.0, 1e-3);
    EXPECT_DOUBLE_EQ(analytic(kTheta + i, kTheta + i), 4e-6 * kDt);
    EXPECT_DOUBLE_EQ(analytic(kBa + i, kBa + i), 2.5e-5 * kDt);
    EXPECT_DOUBLE_EQ(analytic(kBg + i, kBg + i), 1.6e-7 * kDt);
    EXPECT_EQ(analytic(kG + i, kG + i), 0.0) << "gravity does not wander";
  }
  EXPECT_EQ((analytic.array() != 0.0).count(), 5 * 3 + 2 * 3);
}

// How far a Gauss-Markov drift moves in a short while, 2 sigma^2 (1 - exp(-v dt / L)), is what the
// density adds to the velocity's variance.
TEST(Propagation, WanderOfTheMapAddsAsMuchAsItsDriftChanges) {
  constexpr MapWander kWander{.share = 0.01, .length_m = 20.0};
  constexpr double kDt = 0.01;
  for (const double speed : {0.5, 8.0, 40.0}) {
    const double drift = kWander.share * speed;
    const double change = 2.0 * drift * drift * -std::expm1(-speed * kDt / kWander.length_m);
    const double added = process_noise(with_wander(kNoise, kWander, speed), kDt)(kV, kV) -
                         process_noise(kNoise, kDt)(kV, kV);
    EXPECT_NEAR(added / change, 1.0, 0.02) << speed;
  }
}

TEST(Propagation, WanderOfTheMapDoesNotMoveAStandingVehicle) {
  EXPECT_EQ(process_noise(with_wander(kNoise, MapWander{}, 0.0), 0.1), process_noise(kNoise, 0.1));
}

TEST(Propagation, HasWhatAWrongScaleOfTheGyroDoesInATurn) {
  // A quarter of a turn in 5 s, half a percent wrong.
  constexpr double kScaleStd = 0.005;
  constexpr double kTurn_s = 5.0;
  const double rate_radps = 0.5 * std::numbers::pi / kTurn_s;
  const double added =
      process_noise(with_scale_error(kNoise, kScaleStd, rate_radps), kTurn_s)(kTheta, kTheta) -
      process_noise(kNoise, kTurn_s)(kTheta, kTheta);
  EXPECT_NEAR(std::sqrt(added), kScaleStd * 0.5 * std::numbers::pi, 1e-9);
  EXPECT_EQ(process_noise(with_scale_error(kNoise, 0.0, 1.0), 0.1), process_noise(kNoise, 0.1));
  EXPECT_EQ(process_noise(with_scale_error(kNoise, 0.01, 0.0), 0.1), process_noise(kNoise, 0.1));
}

// The noise added over a second must not depend on how finely the second is cut.
TEST(Propagation, NoiseIsIndependentOfTheStepLength) {
  const InertialInput u{.specific_force_mps2 = {0.0, 0.0, 9.81},
                        .angular_rate_radps = Vector3d::Zero()};
  const auto after_one_second = [&](int steps) {
    Covariance P = Covariance::Zero();
    for (int i = 0; i < steps; ++i) {
      propagate_covariance(NominalState{}, u, kNoise, 1.0 / steps, P);
    }
    return P;
  };
  const Covariance fine = after_one_second(400);
  const Covariance coarse = after_one_second(100);
  for (int i = 0; i < 15; ++i) {
    EXPECT_NEAR(coarse(i, i) / fine(i, i), 1.0, 0.01) << i;
  }
}

TEST(Propagation, SwitchedOffStateKeepsZeroCovariance) {
  Covariance P = Covariance::Identity();
  P.middleRows<3>(kG).setZero();
  P.middleCols<3>(kG).setZero();
  Random random(3);
  const InertialInput u{.specific_force_mps2 = random.normal_vector<3>(),
                        .angular_rate_radps = random.normal_vector<3>()};
  propagate_covariance(test::random_state(random), u, kNoise, 0.01, P);
  EXPECT_TRUE(P.middleRows<3>(kG).isZero(0.0));
  EXPECT_TRUE(P.middleCols<3>(kG).isZero(0.0));
}

}  // namespace
}  // namespace topoloc::estimation

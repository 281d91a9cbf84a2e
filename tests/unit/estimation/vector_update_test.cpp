// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/vector_update.hpp"

#include "topoloc/estimation/speed_measurement.hpp"

#include "support/random_states.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace topoloc::estimation {
namespace {

using namespace error_index;
using Eigen::Vector3d;
using test::Random;

// Position measured directly: linear, so that the textbook Kalman filter is the exact answer.
TEST(VectorUpdate, EqualsThePlainKalmanFilterOnALinearMeasurement) {
  Random random(1);
  const NominalState x_bar = test::random_state(random);
  Covariance P_bar = test::random_covariance(random, 0.3);
  // attitude apart: its update is not linear
  P_bar.middleRows<3>(kTheta).setZero();
  P_bar.middleCols<3>(kTheta).setZero();
  const Vector3d measured = x_bar.p_world_imu + Vector3d(0.2, -0.1, 0.3);
  const Eigen::Matrix3d R = Vector3d(0.01, 0.04, 0.02).asDiagonal();
  NominalState x = x_bar;
  Covariance P = P_bar;
  const auto result = update_with_vector<3>(
      [&](const NominalState& x_k) {
        VectorLinearisation<3> m;
        m.z = x_k.p_world_imu - measured;
        m.H.setZero();
        m.H.block<3, 3>(0, kP).setIdentity();
        m.R = R;
        return m;
      },
      1e9, x, P);
  ASSERT_EQ(result.verdict, VectorVerdict::kAccepted);
  const Eigen::Matrix<double, kErrorDim, 3> K =
      P_bar.middleCols<3>(kP) * (P_bar.block<3, 3>(kP, kP) + R).inverse();
  const ErrorVector dx = K * (measured - x_bar.p_world_imu);
  EXPECT_LT((boxminus(x, x_bar) - dx).norm(), 1e-12);
  EXPECT_LT((P - (P_bar - K * P_bar.middleRows<3>(kP))).norm(), 1e-12);
}

NominalState driving_forward(double speed_mps) {
  NominalState x;
  x.R_world_imu = so3::exp({0.01, -0.02, 1.0});
  x.v_world_imu = x.R_world_imu * Vector3d(speed_mps, 0.0, 0.0);
  return x;
}

Vector3d speed_residual(const NominalState& x, const SpeedModel& model, const Vector3d& rate,
                        double speed_mps) {
  return linearise_speed(x, model, rate, 0.0, speed_mps).z;
}

TEST(SpeedMeasurement, AgreesForwardAndInReverse) {
  for (const double speed : {10.0, -3.0}) {
    EXPECT_LT(speed_residual(driving_forward(speed), {}, Vector3d::Zero(), speed).norm(), 1e-12);
  }
}

TEST(SpeedMeasurement, ScalesTheWheelSpeed) {
  SpeedModel model;
  model.wheel_scale = 1.02;
  EXPECT_LT(speed_residual(driving_forward(10.2), model, Vector3d::Zero(), 10.0).norm(), 1e-12);
}

TEST(SpeedMeasurement, LeverArmMovesTheImuSidewaysInATurn) {
  // IMU 1.5 m ahead of and 0.5 m left of the rear axle, turning left: v_imu = v + w x (1.5, 0.5,
  // 0).
  SpeedModel model;
  model.wheel_reference_imu_m = {-1.5, -0.5, 0.0};
  NominalState x;
  x.gyro_bias_radps = {0.0, 0.0, 0.01};
  x.v_world_imu = {8.0 - 0.4 * 0.5, 0.4 * 1.5, 0.0};
  EXPECT_LT(speed_residual(x, model, {0.0, 0.0, 0.41}, 8.0).norm(), 1e-12);
}

TEST(SpeedMeasurement, TurnsIntoVehicleAxes) {
  SpeedModel model;  // IMU mounted with its x axis to the left of the vehicle
  model.R_vehicle_imu = so3::exp({0.0, 0.0, M_PI / 2});
  NominalState x;
  x.v_world_imu = {0.0, -7.0, 0.0};  // IMU's -y is the vehicle's x
  EXPECT_LT(speed_residual(x, model, Vector3d::Zero(), 7.0).norm(), 1e-12);
}

TEST(SpeedMeasurement, GyroNoiseEntersThroughTheLeverArm) {
  SpeedModel model;
  model.wheel_reference_imu_m = {-2.0, 0.0, 0.0};
  const auto with = linearise_speed({}, model, Vector3d::Zero(), 0.1, 5.0).R;
  const auto without = linearise_speed({}, model, Vector3d::Zero(), 0.0, 5.0).R;
  EXPECT_LT(((with - without).diagonal() - Vector3d(0.0, 0.04, 0.04)).norm(), 1e-12);
}

TEST(SpeedMeasurement, DeadBandSaysOnlyThatTheVehicleIsSlow) {
  SpeedModel model;
  model.dead_band_mps = 0.5;
  model.std_forward_mps = 0.05;
  const auto forward_std = [&](double speed) {
    return std::sqrt(linearise_speed({}, model, Vector3d::Zero(), 0.0, speed).R(0, 0));
  };
  EXPECT_NEAR(forward_std(0.0), 0.5, 1e-12);
  EXPECT_NEAR(forward_std(-0.49), 0.5, 1e-12);
  EXPECT_LT(forward_std(0.51), 0.06);
  EXPECT_NEAR(linearise_speed({}, model, Vector3d::Zero(), 0.0, 0.0).R(1, 1), 0.01, 1e-12)
      << "the constraints hold at any speed";
}

VectorUpdateResult apply_speed(NominalState& x, Covariance& P, double speed_mps) {
  return update_with_vector<3>(
      [&](const NominalState& x_k) {
        return linearise_speed(x_k, {}, Vector3d::Zero(), 0.0, speed_mps);
      },
      25.0, x, P);
}

TEST(SpeedMeasurement, CorrectsForwardAndSidewaysVelocity) {
  NominalState x = driving_forward(10.0);
  x.v_world_imu += x.R_world_imu * Vector3d(0.5, 0.3, -0.2);
  Covariance P = Covariance::Zero();
  P.diagonal().segment<3>(kV).setConstant(0.25);
  P.diagonal().segment<3>(kTheta).setConstant(1e-8);
  ASSERT_EQ(apply_speed(x, P, 10.0).verdict, VectorVerdict::kAccepted);
  EXPECT_LT((x.R_world_imu.transpose() * x.v_world_imu - Vector3d(10, 0, 0)).norm(), 0.06);
  EXPECT_LT(P(kV, kV), 0.02);
}

// 5 sigma on one axis is chi-square 25: the gate is on squares.
TEST(VectorUpdate, GateComparesSquaredWithSquared) {
  for (const double sigmas : {4.99, 5.01}) {
    NominalState x;
    x.v_world_imu = {0.0, 0.1 * sigmas, 0.0};
    Covariance P = Covariance::Zero();
    const NominalState before = x;
    const VectorUpdateResult result = apply_speed(x, P, 0.0);
    EXPECT_EQ(result.verdict,
              sigmas < 5.0 ? VectorVerdict::kAccepted : VectorVerdict::kInnovationTooLarge);
    EXPECT_NEAR(result.test_ratio, sigmas * sigmas / 25.0, 1e-9);
    EXPECT_EQ(x.v_world_imu, before.v_world_imu) << "P = 0: nothing moves either way";
  }
}

TEST(VectorUpdate, RejectionLeavesTheStateBitIdentical) {
  Random random(2);
  const NominalState before = test::random_state(random);
  const Covariance P_before = test::random_covariance(random, 0.01);
  for (const double speed : {500.0, std::numeric_limits<double>::quiet_NaN()}) {
    NominalState x = before;
    Covariance P = P_before;
    EXPECT_EQ(apply_speed(x, P, speed).verdict,
              std::isnan(speed) ? VectorVerdict::kNotFinite : VectorVerdict::kInnovationTooLarge);
    EXPECT_EQ(P, P_before);
    EXPECT_EQ(x.R_world_imu, before.R_world_imu);
    EXPECT_EQ(x.v_world_imu, before.v_world_imu);
  }
}

TEST(Standstill, MeasuresVelocityAndGyroBias) {
  NominalState x;
  x.v_world_imu = {0.3, -0.2, 0.1};
  Covariance P = Covariance::Zero();
  P.diagonal().segment<3>(kV).setConstant(0.25);
  P.diagonal().segment<3>(kBg).setConstant(1e-4);
  const Vector3d rate(0.01, -0.005, 0.02);  // all of it is bias
  const auto result = update_with_vector<6>(
      [&](const NominalState& x_k) { return linearise_standstill(x_k, {}, rate, 1.0); }, 30.0, x,
      P);
  ASSERT_EQ(result.verdict, VectorVerdict::kAccepted);
  EXPECT_LT(x.v_world_imu.norm(), 1e-3);
  EXPECT_LT((x.gyro_bias_radps - rate).norm(), 1e-3);
}

}  // namespace
}  // namespace topoloc::estimation

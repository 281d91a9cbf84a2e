// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/geometry/so3.hpp"

#include "mapping/node_maker.hpp"

#include <gtest/gtest.h>

namespace topoloc::mapping {
namespace {

const RigidTransform kT_world_imu{so3::exp({0.3, -0.2, 1.1}), {120.0, -40.0, 3.0}};
const RigidTransform kT_imu_cam{so3::exp({-1.2, 1.1, -1.3}), {1.6, -0.4, 0.9}};

/// Error (theta, p) of the camera's pose, axes as in map::NodeDraft, when the vehicle's is off by
/// `error` = (theta in IMU axes, p in world axes).
Eigen::Matrix<double, 6, 1> camera_error(const Eigen::Matrix<double, 6, 1>& error) {
  const RigidTransform T_world_imu_true{kT_world_imu.R * so3::exp(error.head<3>()),
                                        kT_world_imu.p + error.tail<3>()};
  const RigidTransform believed = kT_world_imu * kT_imu_cam;
  const RigidTransform actual = T_world_imu_true * kT_imu_cam;
  Eigen::Matrix<double, 6, 1> result;
  result << so3::log(believed.R.transpose() * actual.R), actual.p - believed.p;
  return result;
}

/// Of a node whose vehicle pose has independent errors of these deviations, per axis.
Eigen::Matrix<double, 6, 6> covariance(double std_m, double std_rad) {
  PlannedNode node{.T_world_imu = kT_world_imu};
  node.covariance.diagonal() << Eigen::Vector3d::Constant(std_rad * std_rad),
      Eigen::Vector3d::Constant(std_m * std_m);
  return node_covariance(node, kT_imu_cam);
}

TEST(NodeCovariance, IsTheVehiclesErrorSeenFromTheCamera) {
  constexpr double kStd_m = 0.02;
  constexpr double kStd_rad = 0.001;
  constexpr double kStep = 1e-5;
  Eigen::Matrix<double, 6, 6> expected = Eigen::Matrix<double, 6, 6>::Zero();
  for (int i = 0; i < 6; ++i) {
    const Eigen::Matrix<double, 6, 1> step = kStep * Eigen::Matrix<double, 6, 1>::Unit(i);
    const Eigen::Matrix<double, 6, 1> column =
        (i < 3 ? kStd_rad : kStd_m) * (camera_error(step) - camera_error(-step)) / (2.0 * kStep);
    expected += column * column.transpose();
  }
  const auto P = covariance(kStd_m, kStd_rad);
  EXPECT_LT((P - expected).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(P, P.transpose());
}

TEST(NodeCovariance, LeverAddsToThePositionOnlyWithRotation) {
  const auto exact_rotation = covariance(0.02, 0.0);
  EXPECT_TRUE((exact_rotation.topRows<3>().isZero()));
  EXPECT_TRUE((exact_rotation.bottomRightCorner<3, 3>().isApprox(
      0.02 * 0.02 * Eigen::Matrix3d::Identity(), 1e-12)));

  // The lever's length times the angle, across the lever: twice, along it not.
  const auto exact_position = covariance(0.0, 0.01);
  EXPECT_NEAR((exact_position.bottomRightCorner<3, 3>().trace()),
              2.0 * 0.01 * 0.01 * kT_imu_cam.p.squaredNorm(), 1e-12);
}

}  // namespace
}  // namespace topoloc::mapping

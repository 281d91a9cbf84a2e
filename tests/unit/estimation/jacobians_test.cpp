// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
// Every analytic Jacobian of the filter against central differences.
#include "topoloc/estimation/camera_measurement.hpp"
#include "topoloc/estimation/manifold_prior.hpp"
#include "topoloc/estimation/propagation.hpp"
#include "topoloc/estimation/speed_measurement.hpp"

#include "support/random_states.hpp"

#include <gtest/gtest.h>

namespace topoloc::estimation {
namespace {

using namespace error_index;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test::central_differences;
using test::Random;
using test::random_state;

constexpr double kStep = 1e-6;

CameraModel tilted_camera() {
  Eigen::Matrix3d R_cam_imu;  // camera looks along the IMU's x axis
  R_cam_imu << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return {.pinhole = {.width_px = 640,
                      .height_px = 384,
                      .fx_px = 450.0,
                      .fy_px = 440.0,
                      .cx_px = 320.0,
                      .cy_px = 190.0},
          .T_cam_imu = {so3::exp({0.02, -0.03, 0.01}) * R_cam_imu, {0.3, -0.1, 0.2}}};
}

/// A point that the camera at x sees.
Vector3d visible_point(const NominalState& x, const CameraModel& camera, Random& random) {
  const Vector3d q(random.uniform(-3, 3), random.uniform(-2, 2), random.uniform(3, 20));
  return x.T_world_imu() * (camera.T_cam_imu.inverse() * q);
}

TEST(Jacobians, TransitionMatrix) {
  Random random(1);
  for (int trial = 0; trial < 10; ++trial) {
    const NominalState x = random_state(random);
    const InertialInput u{.specific_force_mps2 = 10.0 * random.normal_vector<3>(),
                          .angular_rate_radps = 2.0 * random.normal_vector<3>()};
    for (const double dt_s : {0.005, 0.1, 0.5}) {
      const NominalState y = propagate_state(x, u, dt_s);
      const Covariance numeric = central_differences<kErrorDim>(
          [&](const ErrorVector& d) {
            return boxminus(propagate_state(boxplus(x, d), u, dt_s), y);
          },
          kStep);
      EXPECT_LT((transition_matrix(x, u, dt_s) - numeric).cwiseAbs().maxCoeff(), 2e-8) << dt_s;
    }
  }
}

TEST(Jacobians, Reprojection) {
  Random random(2);
  const CameraModel camera = tilted_camera();
  for (int trial = 0; trial < 20; ++trial) {
    const NominalState x = random_state(random);
    const Vector3d point = visible_point(x, camera, random);
    const Vector2d pixel(100.0, 50.0);
    const auto at = [&](const NominalState& state) {
      return linearise_reprojection(camera.pinhole, camera_pose(state, camera), pixel, point);
    };
    const auto m = at(x);
    ASSERT_TRUE(m);
    Eigen::Matrix<double, 2, kErrorDim> H = Eigen::Matrix<double, 2, kErrorDim>::Zero();
    H.leftCols<6>() = m->G * vehicle_motion(x, camera);
    const auto numeric = central_differences<2>(
        [&](const ErrorVector& d) { return at(boxplus(x, d))->z_px; }, kStep);
    EXPECT_LT((H - numeric).norm(), 1e-7 * (1.0 + H.norm()));
  }
}

TEST(Reprojection, ResidualIsPredictedMinusMeasured) {
  const CameraModel camera = tilted_camera();
  Random random(3);
  const NominalState x = random_state(random);
  const Vector3d point = visible_point(x, camera, random);
  const Vector2d predicted =
      camera.pinhole.project(camera.T_cam_imu * (x.T_world_imu().inverse() * point));
  const auto m = linearise_reprojection(camera.pinhole, camera_pose(x, camera),
                                        predicted + Vector2d(2.0, -3.0), point);
  EXPECT_LT((m->z_px - Vector2d(-2.0, 3.0)).norm(), 1e-9);
}

TEST(Reprojection, RefusesPointsBehindOrTooNear) {
  const CameraModel camera = tilted_camera();
  const NominalState x;
  const RigidTransform T_cam_world = camera_pose(x, camera);
  const auto at_depth = [&](double depth_m) {
    const Vector3d p_world = T_cam_world.inverse() * Vector3d(0, 0, depth_m);
    return linearise_reprojection(camera.pinhole, T_cam_world, {0, 0}, p_world);
  };
  for (const double depth_m : {-5.0, 0.0, 0.99 * kMinDepth_m}) {
    EXPECT_FALSE(at_depth(depth_m));
  }
  EXPECT_TRUE(at_depth(1.01 * kMinDepth_m));
}

TEST(Jacobians, NodePose) {
  Random random(4);
  const CameraModel camera = tilted_camera();
  for (int trial = 0; trial < 20; ++trial) {
    const NominalState x = random_state(random);
    const Vector3d point = visible_point(x, camera, random);
    const RigidTransform T_cam_world = camera_pose(x, camera);
    const RigidTransform T_world_node{random.rotation(),
                                      x.p_world_imu + 3.0 * random.normal_vector<3>()};
    const Vector3d p_node = T_world_node.inverse() * point;
    const auto residual = [&](const Eigen::Matrix<double, 6, 1>& n) {
      const Vector3d moved =
          T_world_node.R * so3::exp(n.head<3>()) * p_node + T_world_node.p + n.tail<3>();
      return linearise_reprojection(camera.pinhole, T_cam_world, Vector2d::Zero(), moved)->z_px;
    };
    const auto m = linearise_reprojection(camera.pinhole, T_cam_world, Vector2d::Zero(), point);
    const Eigen::Matrix<double, 2, 6> H =
        m->G * body_motion(T_cam_world * T_world_node, T_cam_world.R);
    for (int i = 0; i < 6; ++i) {
      const Eigen::Matrix<double, 6, 1> d = kStep * Eigen::Matrix<double, 6, 1>::Unit(i);
      const Vector2d numeric = (residual(d) - residual(-d)) / (2.0 * kStep);
      EXPECT_LT((H.col(i) - numeric).norm(), 1e-7 * (1.0 + H.norm())) << i;
    }
  }
}

TEST(Jacobians, SpeedWithLeverArmAndMountingAngle) {
  Random random(5);
  SpeedModel model;
  model.R_vehicle_imu = so3::exp({0.1, -0.2, 1.5});
  model.wheel_reference_imu_m = {-1.2, 0.3, -0.9};
  for (int trial = 0; trial < 10; ++trial) {
    const NominalState x = random_state(random);
    const Vector3d rate = random.normal_vector<3>();
    const auto numeric = central_differences<3>(
        [&](const ErrorVector& d) {
          return linearise_speed(boxplus(x, d), model, rate, 1e-3, 8.0).z;
        },
        kStep);
    EXPECT_LT((linearise_speed(x, model, rate, 1e-3, 8.0).H - numeric).norm(), 1e-7);
  }
}

TEST(Jacobians, Standstill) {
  Random random(6);
  const NominalState x = random_state(random);
  const Vector3d rate = random.normal_vector<3>();
  const auto numeric = central_differences<6>(
      [&](const ErrorVector& d) { return linearise_standstill(boxplus(x, d), {}, rate, 1.0).z; },
      kStep);
  EXPECT_LT((linearise_standstill(x, {}, rate, 1.0).H - numeric).norm(), 1e-8);
}

// J^k is the derivative of (x_k boxplus d) boxminus x_bar, at small and at large angles.
TEST(Jacobians, PriorAtSmallAndLargeAngles) {
  Random random(7);
  for (const double angle_rad : {0.0, 1e-6, 0.1, 1.0, 3.0}) {
    const NominalState x_bar = random_state(random);
    ErrorVector difference = random.normal_vector<kErrorDim>();
    difference.head<3>() = angle_rad * random.normal_vector<3>().normalized();
    const NominalState x_k = boxplus(x_bar, difference);
    const Covariance numeric = central_differences<kErrorDim>(
        [&](const ErrorVector& d) { return boxminus(boxplus(x_k, d), x_bar); }, kStep);
    const Covariance J = prior_jacobian(x_k, x_bar);
    EXPECT_LT((J - numeric).cwiseAbs().maxCoeff(), 2e-8) << angle_rad;

    const Covariance P_bar = test::random_covariance(random, 0.3);
    const PriorAtIterate prior = prior_at_iterate(x_k, x_bar, P_bar);
    const Covariance J_inverse = J.inverse();
    EXPECT_LT((prior.P - J_inverse * P_bar * J_inverse.transpose()).norm(), 1e-12) << angle_rad;
    EXPECT_LT((prior.offset - J_inverse * boxminus(x_k, x_bar)).norm(), 1e-12) << angle_rad;
  }
}

// The last tangent space: d -> (y boxplus dx boxplus' e) seen from y boxplus dx is J_r(dtheta).
TEST(Jacobians, MoveToUpdatedState) {
  Random random(8);
  const NominalState x = random_state(random);
  ErrorVector dx = ErrorVector::Zero();
  dx.head<3>() = Vector3d(0.4, -0.7, 0.2);
  const NominalState y = boxplus(x, dx);
  const Covariance G = central_differences<kErrorDim>(
      [&](const ErrorVector& d) { return boxminus(boxplus(x, dx + d), y); }, kStep);
  const Covariance P = test::random_covariance(random, 0.2);
  Covariance moved = P;
  move_to_updated_state(dx.head<3>(), moved);
  EXPECT_LT((moved - G * P * G.transpose()).norm(), 1e-8);
  EXPECT_EQ(moved, moved.transpose().eval());
}

TEST(State, BoxplusUndoesBoxminus) {
  Random random(9);
  const NominalState x = random_state(random);
  const NominalState y = random_state(random);
  EXPECT_LT(boxminus(boxplus(y, boxminus(x, y)), x).norm(), 1e-12);
  EXPECT_EQ(boxminus(x, x).tail<15>(), (Eigen::Matrix<double, 15, 1>::Zero()));
}

TEST(State, AllFiniteSeesEveryPart) {
  Random random(10);
  const NominalState x = random_state(random);
  EXPECT_TRUE(all_finite(x));
  for (int i = 0; i < kErrorDim; ++i) {
    ErrorVector d = ErrorVector::Zero();
    d[i] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(all_finite(boxplus(x, d))) << i;
  }
}

}  // namespace
}  // namespace topoloc::estimation

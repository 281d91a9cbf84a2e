// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/ego.hpp"

#include "topoloc/geometry/so3.hpp"
#include "topoloc/simulation/imu.hpp"
#include "topoloc/simulation/wheels.hpp"

#include "unit/simulation/toy_road.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace topoloc::simulation {
namespace {

using testing::highway_road;
using testing::town_road;
using testing::ToyRoad;

double forward_mps(const BodyMotion& motion) {
  return (motion.T_world_body.R.transpose() * motion.velocity_mps).x();
}

TEST(Trajectory, DerivativesAgreeWithCentralDifferences) {
  const ToyRoad toy = town_road();
  const Ego ego = drive_along(toy.road, {}, 5);
  constexpr double h = 1e-4;
  double moved = 0.0;
  for (double t = 1.013; t < ego.duration_s() - 1.0; t += 0.37) {
    const BodyMotion before = ego.trajectory.at(t - h);
    const BodyMotion now = ego.trajectory.at(t);
    const BodyMotion after = ego.trajectory.at(t + h);
    const Eigen::Vector3d v = (after.T_world_body.p - before.T_world_body.p) / (2.0 * h);
    EXPECT_LT((v - now.velocity_mps).norm(), 1e-5) << t;
    const Eigen::Vector3d a = (after.velocity_mps - before.velocity_mps) / (2.0 * h);
    EXPECT_LT((a - now.acceleration_mps2).norm(), 2e-3) << t;
    const Eigen::Vector3d w =
        so3::log(before.T_world_body.R.transpose() * after.T_world_body.R) / (2.0 * h);
    EXPECT_LT((w - now.rate_radps).norm(), 1e-5) << t;
    const Eigen::Vector3d dw = (after.rate_radps - before.rate_radps) / (2.0 * h);
    EXPECT_LT((dw - now.rate_change_radps2).norm(), 5e-3) << t;
    moved += now.velocity_mps.norm() * 0.37;
  }
  EXPECT_GT(moved, 300.0);
}

TEST(Trajectory, MotionOfAFrameOnTheBodyIsThatOfItsPose) {
  const ToyRoad toy = town_road();
  const Ego ego = drive_along(toy.road, {}, 5);
  const RigidTransform T{so3::exp({0.1, -0.2, 0.3}), {1.5, -0.4, 0.8}};
  constexpr double h = 1e-4;
  for (double t = 5.0; t < 30.0; t += 1.1) {
    const BodyMotion before = ego.trajectory.at(t - h).of(T);
    const BodyMotion now = ego.trajectory.at(t).of(T);
    const BodyMotion after = ego.trajectory.at(t + h).of(T);
    const Eigen::Vector3d v = (after.T_world_body.p - before.T_world_body.p) / (2.0 * h);
    EXPECT_LT((v - now.velocity_mps).norm(), 1e-5);
    const Eigen::Vector3d a = (after.velocity_mps - before.velocity_mps) / (2.0 * h);
    EXPECT_LT((a - now.acceleration_mps2).norm(), 1e-2);
  }
}

TEST(Ego, KeepsLimitsOfSpeedAndAcceleration) {
  for (const std::uint64_t key : {1U, 2U, 3U}) {
    SCOPED_TRACE(key);
    const ToyRoad toy = key == 3 ? highway_road() : town_road();
    const Ego ego = drive_along(toy.road, {}, key);
    const double limit = toy.road.speed_limit_mps(0.0);
    double fastest = 0.0;
    double hardest_curve = 0.0;
    double last_mps = 0.0;
    constexpr double kStep_s = 0.1;
    for (double t = 0.0; t <= ego.duration_s(); t += kStep_s) {
      const double v = forward_mps(ego.trajectory.at(t));
      fastest = std::max(fastest, v);
      EXPECT_LE(v, limit * 1.001) << t;
      EXPECT_LE(std::abs(v - last_mps) / kStep_s, 1.5) << t;
      const double sideways = v * v * std::abs(ego.path.curvature_1pm(ego.journey.along_m(t)));
      hardest_curve = std::max(hardest_curve, sideways);
      last_mps = v;
    }
    EXPECT_LE(hardest_curve, 2.5);
    EXPECT_GT(fastest, 0.85 * limit);
  }
}

TEST(Ego, AcceleratesWithoutJerks) {
  const ToyRoad toy = town_road();
  const Ego ego = drive_along(toy.road, {}, 2);
  constexpr double kStep_s = 0.1;
  for (double t = kStep_s; t < ego.duration_s() - kStep_s; t += kStep_s) {
    const auto along = [&](double at) { return ego.journey.along_m(at); };
    const double jerk = (along(t + 1.5 * kStep_s) - 3.0 * along(t + 0.5 * kStep_s) +
                         3.0 * along(t - 0.5 * kStep_s) - along(t - 1.5 * kStep_s)) /
                        (kStep_s * kStep_s * kStep_s);
    EXPECT_LT(std::abs(jerk), 6.0) << t;
  }
}

TEST(Ego, DoesNotSlipSideways) {
  const ToyRoad toy = town_road();
  const Ego ego = drive_along(toy.road, {}, 7);
  for (double t = 0.0; t < ego.duration_s(); t += 0.05) {
    const BodyMotion motion = ego.trajectory.at(t);
    const Eigen::Vector3d v = motion.T_world_body.R.transpose() * motion.velocity_mps;
    EXPECT_LT(std::abs(v.y()), 0.01) << t;
    EXPECT_LT(std::abs(v.z()), 0.15) << t;  // bumps, nodding
  }
}

TEST(Ego, StandsAtBeginAndEndStopsAndBacksUpInTown) {
  for (const std::uint64_t key : {11U, 12U, 13U}) {
    SCOPED_TRACE(key);
    const ToyRoad toy = town_road();
    const Ego ego = drive_along(toy.road, {}, key);
    for (double t = 0.0; t < 3.0; t += 0.1) {
      EXPECT_LT(ego.trajectory.at(t).velocity_mps.norm(), 2e-3) << t;
    }
    for (double t = ego.duration_s() - 1.5; t < ego.duration_s(); t += 0.1) {
      EXPECT_LT(ego.trajectory.at(t).velocity_mps.norm(), 2e-3) << t;
    }
    double backwards_m = 0.0;
    double standing_s = 0.0;
    for (double t = 4.0; t < ego.duration_s() - 2.5; t += 0.1) {
      const double v = forward_mps(ego.trajectory.at(t));
      backwards_m += std::max(0.0, -v) * 0.1;
      standing_s += std::abs(v) < 0.01 ? 0.1 : 0.0;
    }
    EXPECT_GE(backwards_m, 2.9);
    EXPECT_LE(backwards_m, 5.1);
    EXPECT_GE(standing_s, 3.0);
  }
}

TEST(Ego, DoesNotStopOnTheHighway) {
  const ToyRoad toy = highway_road();
  const Ego ego = drive_along(toy.road, {}, 1);
  for (double t = 8.0; t < ego.duration_s() - 8.0; t += 0.1) {
    EXPECT_GT(forward_mps(ego.trajectory.at(t)), 1.0) << t;
  }
}

TEST(Ego, DrivesElsewhereInTheLaneOnAnotherDay) {
  const ToyRoad toy = town_road();
  const Ego a = drive_along(toy.road, {}, 1);
  const Ego b = drive_along(toy.road, {}, 2);
  const Ego again = drive_along(toy.road, {}, 1);
  EXPECT_NE(a.path.left_m(100.0), b.path.left_m(100.0));
  for (double along_m = 10.0; along_m < 480.0; along_m += 7.0) {
    EXPECT_NEAR(a.path.left_m(along_m), -1.75, 0.45001);
    EXPECT_NEAR(b.path.left_m(along_m), -1.75, 0.45001);
    EXPECT_EQ(a.path.left_m(along_m), again.path.left_m(along_m));
  }
}

TEST(Ego, RefusesARoadThatIsTooShort) {
  const ToyRoad toy({{world::Setting::kTown, 20.0, 0.0, 0.0}});
  EXPECT_THROW(drive_along(toy.road, {}, 1), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::simulation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/wheels.hpp"

#include "unit/simulation/toy_road.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace topoloc::simulation {
namespace {

using testing::highway_road;
using testing::town_road;
using testing::ToyRoad;

/// Signed way of the middle of the rear axle.
double true_way_m(const Ego& ego) {
  double way_m = 0.0;
  constexpr double kStep_s = 0.005;
  for (double t = 0.5 * kStep_s; t < ego.duration_s(); t += kStep_s) {
    const BodyMotion motion = ego.trajectory.at(t);
    way_m += kStep_s * std::copysign(motion.velocity_mps.norm(),
                                     motion.velocity_mps.dot(motion.T_world_body.R.col(0)));
  }
  return way_m;
}

double rear_way_m(const std::vector<WheelSample>& samples) {
  double way_m = 0.0;
  for (std::size_t i = 0; i + 1 < samples.size(); ++i) {
    const double dt_s = static_cast<double>(samples[i + 1].time_ns - samples[i].time_ns) * 1e-9;
    const auto mean = [](const WheelSample& s) {
      return 0.5 * (s.speeds_mps[kRearLeft] + s.speeds_mps[kRearRight]);
    };
    way_m += 0.5 * dt_s * (mean(samples[i]) + mean(samples[i + 1]));
  }
  return way_m;
}

TEST(Wheels, IdealOnesIntegrateToTheWay) {
  for (const bool town : {true, false}) {
    const ToyRoad toy = town ? town_road() : highway_road();
    const Ego ego = drive_along(toy.road, {}, 5);
    const auto samples = sense_wheels(ego.trajectory, VehicleModel{}, WheelSpec::ideal(), 1);
    EXPECT_NEAR(rear_way_m(samples), true_way_m(ego), 0.02);
  }
}

TEST(Wheels, RealOnesIntegrateToTheWayWithinTheirStatedError) {
  const ToyRoad toy = town_road();
  const Ego ego = drive_along(toy.road, {}, 5);
  const double way_m = true_way_m(ego);
  const WheelSpec spec;
  double squares = 0.0;
  constexpr int kCars = 40;
  for (std::uint64_t key = 0; key < kCars; ++key) {
    const auto samples = sense_wheels(ego.trajectory, VehicleModel{}, spec, key);
    const double error = (rear_way_m(samples) - way_m) / way_m;
    EXPECT_LT(std::abs(error), 4.0 * spec.radius_error) << key;
    squares += error * error;
  }
  EXPECT_NEAR(std::sqrt(squares / kCars), spec.radius_error, 0.4 * spec.radius_error);
}

TEST(Wheels, FrontOnesRunLargerCirclesAndInnerOnesSmaller) {
  BodyMotion left_turn;
  left_turn.velocity_mps = {5.0, 0.0, 0.0};
  left_turn.rate_radps = {0.0, 0.0, 0.25};  // 20 m of radius
  const VehicleModel model;
  const auto speeds = true_wheel_speeds(left_turn, model);
  const double inner_m = 20.0 - 0.5 * model.track_m;
  EXPECT_NEAR(speeds[kRearLeft], 0.25 * inner_m, 1e-12);
  EXPECT_NEAR(speeds[kFrontLeft], 0.25 * std::hypot(inner_m, model.wheelbase_m), 1e-12);
  EXPECT_GT(speeds[kFrontRight], speeds[kFrontLeft]);
  left_turn.velocity_mps = {-5.0, 0.0, 0.0};
  EXPECT_LT(true_wheel_speeds(left_turn, model)[kFrontLeft], -4.0);
}

TEST(Wheels, ReadZeroWhereTheyCreep) {
  const ToyRoad toy = town_road();
  const Ego ego = drive_along(toy.road, {}, 5);
  const WheelSpec spec;
  int creeping = 0;
  for (const WheelSample& sample : sense_wheels(ego.trajectory, VehicleModel{}, spec, 3)) {
    const double speed =
        ego.trajectory.at(static_cast<double>(sample.time_ns) * 1e-9).velocity_mps.norm();
    if (speed < 0.9 * spec.dead_band_mps) {
      creeping += speed > 0.05 ? 1 : 0;
      EXPECT_EQ(sample.speeds_mps[kRearLeft], 0.0);
    }
  }
  EXPECT_GT(creeping, 5);
}

TEST(Wheels, SlipOnDemandOnDrivenWheelsOnly) {
  const ToyRoad toy = town_road();
  const Ego ego = drive_along(toy.road, {}, 5);
  WheelSpec spec = WheelSpec::ideal();
  spec.slip = true;
  const auto slipping = sense_wheels(ego.trajectory, VehicleModel{}, spec, 3);
  const auto rolling = sense_wheels(ego.trajectory, VehicleModel{}, WheelSpec::ideal(), 3);
  int slipped = 0;
  for (std::size_t i = 0; i < slipping.size(); ++i) {
    EXPECT_EQ(slipping[i].speeds_mps[kRearRight], rolling[i].speeds_mps[kRearRight]);
    slipped += std::abs(slipping[i].speeds_mps[kFrontLeft] - rolling[i].speeds_mps[kFrontLeft]) >
                       0.05 * std::abs(rolling[i].speeds_mps[kFrontLeft]) + 0.01
                   ? 1
                   : 0;
  }
  EXPECT_GT(slipped, 20);
  EXPECT_LT(slipped, static_cast<int>(slipping.size()) / 4);
}

}  // namespace
}  // namespace topoloc::simulation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/gnss.hpp"

#include "unit/simulation/toy_road.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::simulation {
namespace {

using testing::highway_road;
using testing::town_road;
using testing::ToyRoad;

/// No error but what a test puts in.
GnssSpec without_errors() {
  GnssSpec spec;
  spec.horizontal_m = 0.0;
  spec.vertical_m = 0.0;
  spec.white_m = 0.0;
  spec.jumps_per_min = 0.0;
  return spec;
}

/// Errors of the positions, one after the other.
std::vector<Eigen::Vector3d> errors(const ToyRoad& toy, const Ego& ego, const GnssSpec& spec,
                                    std::uint64_t key) {
  const RigidTransform T_vehicle_imu = nominal_mounting().T_vehicle_imu;
  std::vector<Eigen::Vector3d> result;
  for (const auto& fix : sense_satellites(ego, T_vehicle_imu, *toy.route, spec, key)) {
    const BodyMotion imu =
        ego.trajectory.at(static_cast<double>(fix.time_ns) * 1e-9).of(T_vehicle_imu);
    result.emplace_back(fix.T_world_imu.p - imu.T_world_body.p);
  }
  return result;
}

TEST(Gnss, WhiteErrorHasItsSizeAndNoMemory) {
  const ToyRoad toy = town_road();
  const Ego ego = drive_along(toy.road, {}, 5);
  GnssSpec spec = without_errors();
  spec.white_m = 0.2;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  Eigen::Vector3d products = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (std::uint64_t key = 0; key < 10; ++key) {
    const auto found = errors(toy, ego, spec, key);
    for (std::size_t i = 1; i < found.size(); ++i) {
      squares += found[i].cwiseAbs2();
      products += found[i].cwiseProduct(found[i - 1]);
      count += 1.0;
    }
  }
  EXPECT_NEAR(std::sqrt(squares.x() / count), 0.2, 0.01);
  EXPECT_NEAR(std::sqrt(squares.y() / count), 0.2, 0.01);
  EXPECT_NEAR(std::sqrt(squares.z() / count), 0.3, 0.015);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(products[axis] / squares[axis], 0.0, 0.08) << axis;
  }
}

TEST(Gnss, SlowErrorHasItsSizeFromTheBeginAndWandersWithinAMinute) {
  const ToyRoad toy = town_road();
  const Ego ego = drive_along(toy.road, {}, 5);
  const GnssSpec real;
  GnssSpec spec = without_errors();
  spec.horizontal_m = real.horizontal_m;
  spec.vertical_m = real.vertical_m;
  constexpr std::uint64_t kDrives = 400;
  constexpr std::size_t kLater = 150;  // half a minute
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Vector3d later = Eigen::Vector3d::Zero();
  Eigen::Vector3d both = Eigen::Vector3d::Zero();
  for (std::uint64_t key = 0; key < kDrives; ++key) {
    const auto found = errors(toy, ego, spec, key);
    ASSERT_GT(found.size(), kLater);
    first += found.front().cwiseAbs2() / kDrives;
    later += found[kLater].cwiseAbs2() / kDrives;
    both += found.front().cwiseProduct(found[kLater]) / kDrives;
  }
  const Eigen::Vector3d stated(real.horizontal_m, real.horizontal_m, real.vertical_m);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(std::sqrt(first[axis]), stated[axis], 0.12 * stated[axis]) << axis;
    EXPECT_NEAR(std::sqrt(later[axis]), stated[axis], 0.12 * stated[axis]) << axis;
    EXPECT_NEAR(both[axis] / std::sqrt(first[axis] * later[axis]),
                std::exp(-30.0 / real.correlation_s), 0.12)
        << axis;
  }
}

TEST(Gnss, JumpsInTownOnly) {
  GnssSpec spec = without_errors();
  spec.jumps_per_min = GnssSpec{}.jumps_per_min;
  const ToyRoad town = town_road();
  const Ego in_town = drive_along(town.road, {}, 5);
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double jumps = 0.0;
  constexpr std::uint64_t kDrives = 100;
  for (std::uint64_t key = 0; key < kDrives; ++key) {
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& error : errors(town, in_town, spec, key)) {
      if (error.norm() > 1e-6 && (error - before).norm() > 1e-6) {
        squares += error.cwiseAbs2();
        jumps += 1.0;
      }
      before = error;
    }
  }
  ASSERT_GT(jumps, kDrives);
  EXPECT_LT(jumps, kDrives * spec.jumps_per_min * in_town.duration_s() / 60.0);
  EXPECT_NEAR(std::sqrt(squares.x() / jumps), spec.jump_m, 0.15 * spec.jump_m);
  EXPECT_NEAR(std::sqrt(squares.z() / jumps), 1.5 * spec.jump_m, 0.2 * spec.jump_m);

  const ToyRoad highway = highway_road();
  const Ego outside = drive_along(highway.road, {}, 5);
  for (const Eigen::Vector3d& error : errors(highway, outside, spec, 3)) {
    EXPECT_LT(error.norm(), 1e-6);
  }
}

TEST(Gnss, IsSilentInATunnel) {
  const ToyRoad toy = highway_road();  // 600 to 900 m: tunnel
  const Ego ego = drive_along(toy.road, {}, 5);
  int before = 0;
  int behind = 0;
  for (const auto& fix : sense_satellites(ego, RigidTransform{}, *toy.route, GnssSpec{}, 3)) {
    const double along_m = ego.along_m(static_cast<double>(fix.time_ns) * 1e-9);
    EXPECT_TRUE(along_m <= 600.0 || along_m >= 900.0) << along_m;
    before += along_m <= 600.0 ? 1 : 0;
    behind += along_m >= 900.0 ? 1 : 0;
  }
  EXPECT_GT(before, 50);
  EXPECT_GT(behind, 50);
}

}  // namespace
}  // namespace topoloc::simulation

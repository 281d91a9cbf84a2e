// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/world/random.hpp"
#include "topoloc/world/route.hpp"

#include "world/route_plan.hpp"

#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

namespace topoloc::world {
namespace {

TEST(Random, KeysTellDrawsApart) {
  std::set<std::uint64_t> keys;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    for (std::uint64_t what = 0; what < 10; ++what) {
      keys.insert(key(seed, {what}));
      keys.insert(key(seed, {what, 0}));
      keys.insert(key(seed, {0, what + 1}));
    }
  }
  EXPECT_EQ(keys.size(), 300U);
}

TEST(Random, UniformAndNormalHaveTheirMoments) {
  Random random(key(3, {1}));
  double sum = 0.0;
  double squares = 0.0;
  double uniform = 0.0;
  constexpr int kCount = 100000;
  for (int i = 0; i < kCount; ++i) {
    const double n = random.normal();
    sum += n;
    squares += n * n;
    uniform += random.uniform(2.0, 4.0);
  }
  EXPECT_NEAR(sum / kCount, 0.0, 0.02);
  EXPECT_NEAR(squares / kCount, 1.0, 0.03);
  EXPECT_NEAR(uniform / kCount, 3.0, 0.01);
}

TEST(Random, BelowReachesAllAndNoMore) {
  Random random(5);
  std::set<int> seen;
  for (int i = 0; i < 1000; ++i) {
    seen.insert(random.below(7));
  }
  EXPECT_EQ(seen, (std::set<int>{0, 1, 2, 3, 4, 5, 6}));
}

TEST(Route, BeginsAtTheOriginHeadingEast) {
  const Route route({{Setting::kTown, 100.0, 0.0, 0.0}});
  const RigidTransform T = route.T_world_road(0.0);
  EXPECT_LT(T.p.norm(), 1e-12);
  EXPECT_LT((T.R - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_LT((route.point(100.0, 0.0) - Eigen::Vector3d(100.0, 0.0, 0.0)).norm(), 1e-9);
}

TEST(Route, ArcTurnsAboutItsMiddle) {
  // Curvature of 1/50 at once, then a quarter turn.
  const double radius_m = 50.0;
  const Route route({{Setting::kTown, 1e-6, 1.0 / radius_m, 0.0},
                     {Setting::kTown, 0.5 * std::numbers::pi * radius_m, 1.0 / radius_m, 0.0}});
  const Eigen::Vector3d end = route.point(route.length_m(), 0.0);
  EXPECT_NEAR(end.x(), radius_m, 0.2);
  EXPECT_NEAR(end.y(), radius_m, 0.2);
}

TEST(Route, GoesStraightOnOutside) {
  const Route route({{Setting::kTown, 40.0, 0.02, 0.04}});
  const RigidTransform T = route.T_world_road(40.0);
  const Eigen::Vector3d beyond = route.point(50.0, 0.0);
  EXPECT_LT((beyond - (T.p + 10.0 * T.R.col(0))).norm(), 1e-9);
  EXPECT_NEAR(route.point(-7.0, 0.0).x(), -7.0, 1e-9);
}

TEST(Route, RefusesStretchesWithoutLength) {
  EXPECT_THROW(Route({{Setting::kTown, 0.0, 0.0, 0.0}}), std::invalid_argument);
  EXPECT_THROW(Route({}), std::invalid_argument);
}

class PlannedRoute : public testing::TestWithParam<Scenario> {};

TEST_P(PlannedRoute, IsSmoothDrivableAndAsLongAsAsked) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const double length_m = seed % 2 == 0 ? 300.0 : 1700.0;
    const Route route = plan_route({GetParam(), seed, length_m});
    ASSERT_NEAR(route.length_m(), length_m, 1e-6);
    constexpr double kStep_m = 0.5;
    RigidTransform before = route.T_world_road(0.0);
    for (double s = kStep_m; s <= length_m; s += kStep_m) {
      const RigidTransform T = route.T_world_road(s);
      ASSERT_NEAR((T.p - before.p).norm(), kStep_m, 1e-3) << "at " << s;
      ASSERT_LT((before.R.transpose() * T.R - Eigen::Matrix3d::Identity()).norm(), 0.06)
          << "at " << s;
      ASSERT_LE(std::abs(route.curvature_1pm(s)), 1.0 / 15.0);
      ASSERT_LE(std::abs(T.R(2, 0)), 0.06);
      ASSERT_GT(T.R(0, 0), 0.0) << "turns back at " << s;
      before = T;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, PlannedRoute,
                         testing::Values(Scenario::kTown, Scenario::kHighway, Scenario::kTunnel,
                                         Scenario::kMixed));

TEST(PlanRoute, MixedHasAllSettingsEvenWhenShort) {
  for (std::uint64_t seed = 1; seed < 6; ++seed) {
    const Route route = plan_route({Scenario::kMixed, seed, 300.0});
    std::vector<Setting> order;
    for (const Stretch& stretch : route.stretches()) {
      if (order.empty() || order.back() != stretch.setting) {
        order.push_back(stretch.setting);
      }
    }
    EXPECT_EQ(order, (std::vector<Setting>{Setting::kTown, Setting::kHighway, Setting::kTunnel,
                                           Setting::kHighway}));
  }
}

TEST(PlanRoute, SeedsDiffer) {
  const Route one = plan_route({Scenario::kTown, 1, 800.0});
  const Route two = plan_route({Scenario::kTown, 2, 800.0});
  EXPECT_GT((one.point(800.0, 0.0) - two.point(800.0, 0.0)).norm(), 1.0);
}

TEST(PlanRoute, RefusesLengthsThatMakeNoSense) {
  EXPECT_THROW(plan_route({Scenario::kTown, 1, 5.0}), std::invalid_argument);
  EXPECT_THROW(plan_route({Scenario::kTown, 1, std::nan("")}), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::world

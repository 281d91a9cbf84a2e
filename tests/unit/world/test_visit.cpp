// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/world/world.hpp"

#include "world/vehicle_size.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

namespace topoloc::world {
namespace {

struct Box {
  Eigen::Vector2d middle;
  Eigen::Vector2d along;  ///< unit
  double half_length_m;
  double half_width_m;
};

Box box_of(const World& world, const Instance& instance) {
  const VehicleSize size = size_of(world.meshes[instance.mesh]);
  const Eigen::Vector3d middle =
      instance.T_world_mesh * Eigen::Vector3d(0.5 * (size.front_m + size.rear_m), 0.0, 0.0);
  const Eigen::Vector2d along = instance.T_world_mesh.R.col(0).head<2>().normalized();
  return {middle.head<2>(), along, 0.5 * (size.front_m - size.rear_m), size.half_width_m};
}

// Separating axes.
bool overlap(const Box& a, const Box& b) {
  const auto half = [](const Box& box, const Eigen::Vector2d& axis) {
    const Eigen::Vector2d across(-box.along.y(), box.along.x());
    return box.half_length_m * std::abs(axis.dot(box.along)) +
           box.half_width_m * std::abs(axis.dot(across));
  };
  for (const Box* box : {&a, &b}) {
    for (const Eigen::Vector2d& axis :
         {box->along, Eigen::Vector2d(-box->along.y(), box->along.x())}) {
      if (std::abs(axis.dot(a.middle - b.middle)) > half(a, axis) + half(b, axis)) {
        return false;
      }
    }
  }
  return true;
}

Box ego_box(const World& world, double along_m, double left_m) {
  RigidTransform T = world.route.T_world_road(along_m);
  const Eigen::Vector3d middle = T * Eigen::Vector3d(1.3, left_m, 0.0);
  return {middle.head<2>(), T.R.col(0).head<2>().normalized(), 2.5, 1.0};
}

class Traffic : public testing::TestWithParam<Scenario> {};

TEST_P(Traffic, RunsIntoNobody) {
  const World world = make_world({GetParam(), 4, 600.0});
  const Visit visit(world, {7, 0.6, 30.0});
  std::size_t seen = 0;
  for (double s = 0.0; s < 600.0; s += 3.0) {
    const double time_s = s / 12.0;
    const double left_m = world.lanes(s).front().left_m;
    std::vector<Box> boxes{ego_box(world, s, left_m)};
    for (const Instance& instance : visit.moving(time_s, s, left_m)) {
      boxes.push_back(box_of(world, instance));
    }
    seen += boxes.size() - 1;
    for (const Instance& parked : visit.parked()) {
      if ((parked.T_world_mesh.p - world.route.point(s, 0.0)).norm() < 80.0) {
        boxes.push_back(box_of(world, parked));
      }
    }
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (std::size_t j = i + 1; j < boxes.size(); ++j) {
        ASSERT_FALSE(overlap(boxes[i], boxes[j]))
            << "vehicles " << i << " and " << j << " at " << s;
      }
    }
  }
  EXPECT_GT(seen, 400U);
}

TEST_P(Traffic, IsAFunctionOfSeedTimeAndPlace) {
  const World world = make_world({GetParam(), 4, 400.0});
  const Visit one(world, {7, 0.5, 20.0});
  const Visit again(world, {7, 0.5, 20.0});
  const Visit other(world, {8, 0.5, 20.0});
  const auto a = one.moving(10.0, 120.0, -1.6);
  const auto b = again.moving(10.0, 120.0, -1.6);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].T_world_mesh.p, b[i].T_world_mesh.p);
    EXPECT_EQ(a[i].seed, b[i].seed);
  }
  const auto c = other.moving(10.0, 120.0, -1.6);
  EXPECT_TRUE(a.size() != c.size() || (a[0].T_world_mesh.p - c[0].T_world_mesh.p).norm() > 1e-3);
}

/// Way along the route of a point near it.
double along_m(const Route& route, const Eigen::Vector3d& p, double guess_m) {
  for (int i = 0; i < 8; ++i) {
    guess_m += (route.T_world_road(guess_m).inverse() * p).x();
  }
  return guess_m;
}

TEST_P(Traffic, NeitherTheVehicleAheadNorTheOneBehindDrivesBackwards) {
  const World world = make_world({GetParam(), 4, 1500.0});
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Visit visit(world, {seed, 0.0, 10.0});
    double ahead_m = 0.0;
    double behind_m = -1000.0;
    double nearest_m = 1e9;
    double farthest_m = 0.0;
    for (double s = 0.0; s < 1500.0; s += 2.0) {
      const auto vehicles = visit.moving(0.0, s, world.lanes(s).front().left_m);
      ASSERT_GE(vehicles.size(), 2U);
      const auto place = [&](std::size_t from_last, double guess_m) {
        return along_m(world.route, vehicles[vehicles.size() - from_last].T_world_mesh.p, guess_m);
      };
      const double ahead = place(2, std::max(ahead_m, s + 20.0));
      const double behind = place(1, std::max(behind_m, s - 150.0));
      ASSERT_GE(ahead, ahead_m - 0.02) << "at " << s;
      ASSERT_GE(behind, behind_m - 0.02) << "at " << s;
      ASSERT_GT(ahead - s, 15.0) << "at " << s;
      ASSERT_LT(behind - s, -10.0) << "at " << s;
      ahead_m = ahead;
      behind_m = behind;
      nearest_m = std::min(nearest_m, ahead - s);
      farthest_m = std::max(farthest_m, ahead - s);
    }
    EXPECT_LT(nearest_m, 60.0);
    EXPECT_GT(farthest_m, 90.0);  // draws away now and then
  }
}

INSTANTIATE_TEST_SUITE_P(All, Traffic,
                         testing::Values(Scenario::kTown, Scenario::kHighway, Scenario::kTunnel,
                                         Scenario::kMixed));

TEST(Visit, RefusesAWorldThatLacksModelsOfCars) {
  World world = make_world({Scenario::kTown, 2, 100.0});
  world.car_meshes.resize(4);
  EXPECT_THROW(Visit(world, {1, 0.5, 10.0}), std::invalid_argument);
  world.car_meshes.clear();
  const Visit empty(world, {1, 0.5, 10.0});
  EXPECT_TRUE(empty.parked().empty());
  EXPECT_TRUE(empty.moving(1.0, 50.0, -1.6).empty());
}

TEST(Visit, ParkedCarsDifferBetweenVisits) {
  const World world = make_world({Scenario::kTown, 2, 500.0});
  const Visit one(world, {1, 0.5, 0.0});
  const Visit two(world, {2, 0.5, 0.0});
  EXPECT_GT(one.parked().size(), 20U);
  std::size_t alike = 0;
  for (const Instance& a : one.parked()) {
    for (const Instance& b : two.parked()) {
      alike += (a.T_world_mesh.p - b.T_world_mesh.p).norm() < 1e-6 ? 1 : 0;
    }
  }
  EXPECT_EQ(alike, 0U);
  EXPECT_TRUE(Visit(world, {1, 0.0, 0.0}).parked().empty());
  EXPECT_TRUE(one.moving(0.0, 100.0, -1.6).empty());
}

TEST(Visit, OncomingTrafficComesNearerFasterThanOneDrives) {
  const World world = make_world({Scenario::kTown, 2, 800.0});
  const Visit visit(world, {3, 0.0, 40.0});
  const auto oncoming = [&](double time_s) {
    std::vector<Eigen::Vector3d> places;
    for (const Instance& vehicle : visit.moving(time_s, 300.0, -1.625)) {
      if (vehicle.T_world_mesh.R.col(0).dot(world.route.T_world_road(300.0).R.col(0)) < -0.5) {
        places.push_back(vehicle.T_world_mesh.p);
      }
    }
    return places;
  };
  const auto before = oncoming(5.0);
  const auto after = oncoming(5.1);
  ASSERT_FALSE(before.empty());
  ASSERT_FALSE(after.empty());
  double moved = 1e9;
  for (const auto& p : after) {
    moved = std::min(moved, (p - before.front()).norm());
  }
  EXPECT_NEAR(moved, 1.3, 0.3);
}

}  // namespace
}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/ground.hpp"

#include "support/random_states.hpp"

#include <functional>
#include <utility>

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

const Eigen::Vector3d kVehicle(3.0, 2.0, 1.3);

/// Points 5 cm apart around the vehicle; `height` of x and y.
mapping::CloudGrid ground_cloud(const std::function<double(double, double)>& height) {
  mapping::PointCloud cloud;
  for (double x = -2.0; x < 8.0; x += 0.05) {
    for (double y = -3.0; y < 7.0; y += 0.05) {
      cloud.positions_m.emplace_back(Eigen::Vector3d(x, y, height(x, y)).cast<float>());
      cloud.intensities.push_back(1.0F);
    }
  }
  return mapping::CloudGrid(std::move(cloud));
}

TEST(GroundBelow, GivesHeightAndSlopeOfTheRoad) {
  const auto ground = ground_below(
      ground_cloud([](double x, double y) { return 0.2 + 0.08 * (x - 3.0) - 0.03 * (y - 2.0); }),
      kVehicle);
  ASSERT_TRUE(ground.has_value());
  EXPECT_EQ(ground->place, kVehicle.head<2>());
  EXPECT_NEAR(ground->height_m, 0.2, 1e-4);
  EXPECT_NEAR(ground->slope.x(), 0.08, 1e-3);
  EXPECT_NEAR(ground->slope.y(), -0.03, 1e-3);
}

TEST(GroundBelow, IsTheRoadAndNotTheKerbBesideIt) {
  test::Random random(4);
  const auto ground = ground_below(ground_cloud([&](double x, double y) {
                                     const double kerb_m = y > 2.75 ? 0.16 : 0.0;
                                     return 0.05 * (x - 3.0) + kerb_m + 0.01 * random.normal();
                                   }),
                                   kVehicle);
  ASSERT_TRUE(ground.has_value());
  EXPECT_NEAR(ground->height_m, 0.0, 0.02);
  EXPECT_NEAR(ground->slope.x(), 0.05, 0.02);
  EXPECT_NEAR(ground->slope.y(), 0.0, 0.03);
}

TEST(GroundBelow, IsNothingWithoutARoad) {
  // A hole in the cloud, and a floor too far below.
  const mapping::CloudGrid level = ground_cloud([](double, double) { return 0.0; });
  EXPECT_FALSE(ground_below(level, {30.0, 2.0, 1.3}).has_value());
  EXPECT_FALSE(ground_below(level, {3.0, 2.0, 12.0}).has_value());
  EXPECT_TRUE(ground_below(level, kVehicle).has_value());
}

TEST(GroundBelow, IsNothingInABush) {
  test::Random random(5);
  const mapping::CloudGrid bush =
      ground_cloud([&](double, double) { return random.uniform(-1.5, 1.0); });
  EXPECT_FALSE(ground_below(bush, kVehicle).has_value());
}

TEST(GroundBelow, IsNotWhatIsAboveThePoint) {
  const auto ground = ground_below(
      ground_cloud([](double x, double) { return x > 3.2 && x < 3.6 ? 2.0 : 0.0; }), kVehicle);
  ASSERT_TRUE(ground.has_value());
  EXPECT_NEAR(ground->height_m, 0.0, 1e-3);
  EXPECT_NEAR(ground->slope.norm(), 0.0, 1e-3);
}

}  // namespace
}  // namespace topoloc::refinement

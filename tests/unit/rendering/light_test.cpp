// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/world/world.hpp"

#include "rendering/head_lamps.hpp"
#include "rendering/lamps.hpp"
#include "rendering/sky.hpp"
#include "rendering/value_cache.hpp"
#include "unit/rendering/small_world.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::rendering {
namespace {

using test::add_rectangle;
using test::add_surface;

/// A wall across the x axis.
world::World wall_at(float x_m, float half_width_m) {
  world::World world;
  world.meshes.resize(1);
  add_rectangle(world.meshes[0], {x_m, -half_width_m, 0.0F}, {0.0F, 2.0F * half_width_m, 0.0F},
                {0.0F, 0.0F, 8.0F}, add_surface(world, world::Material::kConcrete));
  return world;
}

/// Where a ray meets the world.
Patch seen(const Raycaster& raycaster, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  Patch patch;
  patch.direction = (to_m - from_m).normalized();
  const auto hit = raycaster.cast({from_m, patch.direction});
  EXPECT_TRUE(hit.has_value());
  patch.hit = hit.value_or(Hit{});
  return patch;
}

TEST(HeadLamps, AreCutOffBelowTheHorizon) {
  const world::World world = wall_at(25.0F, 20.0F);
  const Raycaster raycaster(world, {});
  constexpr double kHeight_m = 0.65;
  const HeadLamps lamps(RigidTransform{Eigen::Matrix3d::Identity(), {0.0, 0.0, kHeight_m}});
  const auto light_at = [&](double height_m) {
    std::array<Patch, 1> patches{seen(raycaster, {0.0, 0.0, 1.3}, {25.0, 0.0, height_m})};
    lamps.shine(raycaster, patches);
    return static_cast<double>(patches[0].head_lamps);
  };
  const double cut_off_m = kHeight_m - 25.0 * std::tan(0.6 * 0.0174533);
  EXPECT_GT(light_at(cut_off_m - 0.3), 10.0 * light_at(cut_off_m + 0.4));
  EXPECT_GT(light_at(1.5), 0.0);
  // 20,000 candela each: some 60 lx there.
  EXPECT_NEAR(1e5 * light_at(cut_off_m - 0.3), 50.0, 25.0);
}

/// A lamp 5 m above a floor, below a vault, with a wall behind which it is dark.
world::World lit_hall() {
  world::World world;
  world.meshes.resize(1);
  const std::uint32_t concrete = add_surface(world, world::Material::kConcrete);
  world::Mesh& mesh = world.meshes[0];
  add_rectangle(mesh, {-50.0F, -50.0F, 0.0F}, {100.0F, 0.0F, 0.0F}, {0.0F, 100.0F, 0.0F}, concrete);
  add_rectangle(mesh, {-50.0F, -50.0F, 5.4F}, {100.0F, 0.0F, 0.0F}, {0.0F, 100.0F, 0.0F}, concrete);
  add_rectangle(mesh, {4.0F, -50.0F, 0.0F}, {0.0F, 100.0F, 0.0F}, {0.0F, 0.0F, 5.4F}, concrete);
  for (const double y_m : {-6.0, -3.0, 0.0, 3.0, 6.0}) {
    world::Lamp lamp;
    lamp.position_m = {0.0, y_m, 5.0};
    lamp.intensity = 0.02;
    lamp.cos_cone = 0.1;
    lamp.always_on = true;
    world.lamps.push_back(lamp);
  }
  return world;
}

TEST(Lamps, LightWhatIsBelowAndALittleWhatIsAboveAndNothingBehindAWall) {
  const world::World world = lit_hall();
  const Raycaster raycaster(world, {});
  const Lamps lamps(raycaster, false);
  std::array<Patch, 3> patches{seen(raycaster, {0.0, 0.0, 2.0}, {0.0, 1.0, 0.0}),
                               seen(raycaster, {0.0, 0.0, 2.0}, {0.0, 1.0, 5.4}),
                               seen(raycaster, {8.0, 0.0, 2.0}, {8.0, 1.0, 0.0})};
  lamps.shine(patches);
  const float below = patches[0].lamps;
  EXPECT_GT(below, 0.02F / 25.0F);
  EXPECT_LT(below, 5.0F * 0.02F / 25.0F);
  EXPECT_GT(patches[1].lamps, 0.05F * below);
  EXPECT_LT(patches[1].lamps, 0.6F * below);
  EXPECT_LT(patches[2].lamps, 0.3F * below);  // what is thrown about does not know of the wall
}

TEST(Sky, HasAnotherSunAndOtherCloudsOnAnotherDay) {
  const Illumination one = illumination(Light::kDay, 1);
  EXPECT_EQ(illumination(Light::kDay, 1).to_sun, one.to_sun);
  double least = 1.0;
  double most = 0.0;
  for (std::uint64_t seed = 2; seed < 40; ++seed) {
    const Illumination other = illumination(Light::kDay, seed);
    EXPECT_LT(other.to_sun.dot(one.to_sun), 0.9999) << seed;
    EXPECT_NE(other.cloud_cover, one.cloud_cover) << seed;
    least = std::min(least, other.to_sun.z());
    most = std::max(most, other.to_sun.z());
  }
  EXPECT_GT(least, 0.35);
  EXPECT_LT(least, 0.55);
  EXPECT_GT(most, 0.75);
  const Sky sky(one, 1);
  const Sky again(one, 1);
  const Sky other(one, 2);
  const Eigen::Vector3d up = Eigen::Vector3d(0.3, 0.5, 0.6).normalized();
  EXPECT_EQ(sky.radiance(up), again.radiance(up));
  bool differs = false;
  for (double x = -1.0; x < 1.0; x += 0.1) {
    const Eigen::Vector3d direction = Eigen::Vector3d(x, 0.4, 0.6).normalized();
    differs |= std::abs(sky.radiance(direction) - other.radiance(direction)) > 0.02F;
  }
  EXPECT_TRUE(differs);
}

TEST(ValueCache, KeepsWhatItHasWhileItGrows) {
  ValueCache cache;
  EXPECT_FALSE(cache.find(7).has_value());
  constexpr std::uint64_t kMany = 200'000;  // more than half of what it begins with
  const auto key = [](std::uint64_t i) { return i * 0x9E3779B97F4A7C15U | 1U; };
  for (std::uint64_t i = 1; i <= kMany; ++i) {
    cache.add(key(i), static_cast<float>(i));
  }
  cache.make_room();
  std::uint64_t kept = 0;
  for (std::uint64_t i = 1; i <= kMany; ++i) {
    const auto found = cache.find(key(i));
    ASSERT_TRUE(!found || *found == static_cast<float>(i)) << i;
    kept += found ? 1U : 0U;
  }
  EXPECT_GT(kept, kMany * 99 / 100);
}

TEST(ValueCache, ForgetsRatherThanTakeMoreMemoryThanItMay) {
  ValueCache cache(1);
  const auto key = [](std::uint64_t i) { return i * 0x9E3779B97F4A7C15U | 1U; };
  for (std::uint64_t i = 1; i <= 200'000; ++i) {
    cache.add(key(i), 1.0F);
  }
  cache.make_room();
  EXPECT_FALSE(cache.find(key(1)).has_value());
  cache.add(key(1), 2.0F);
  EXPECT_EQ(cache.find(key(1)), 2.0F);
}

TEST(WorldSeenFromTheLane, HasNothingButTreesAboveATownsLane) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    const world::World world = world::make_world({world::Scenario::kTown, seed, 250.0});
    const Raycaster raycaster(world, {});
    for (double s = 4.0; s < world.route.length_m() - 4.0; s += 0.5) {
      const double left_m = world.lanes(s).front().left_m;
      const Eigen::Vector3d from_m = world.route.point(s, left_m, 1.0);
      const auto hit = raycaster.cast({from_m, Eigen::Vector3d::UnitZ()});
      if (hit) {
        EXPECT_TRUE(hit->surface->material == world::Material::kFoliage ||
                    hit->surface->material == world::Material::kBark)
            << "seed " << seed << " at " << s << " m: " << hit->distance_m << " m above the lane";
      }
    }
  }
}

TEST(WorldSeenFromAbove, HasParkedCarsOnTheRoad) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    const world::World world = world::make_world({world::Scenario::kTown, seed, 250.0});
    const Raycaster raycaster(world, {});
    for (const world::ParkingPlace& place : world.parking) {
      const Eigen::Vector3d up = place.T_world_place.R.col(2);
      const auto hit = raycaster.cast({place.T_world_place.p + 1.0 * up, -up});
      ASSERT_TRUE(hit);
      EXPECT_NEAR(hit->distance_m, 1.0, 0.05)
          << "seed " << seed << " at " << place.T_world_place.p.transpose();
    }
  }
}

}  // namespace
}  // namespace topoloc::rendering

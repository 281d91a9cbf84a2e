// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/world/random.hpp"
#include "topoloc/world/surface.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::world {
namespace {

struct Case {
  const char* name;
  Surface surface;
  double size_m;  ///< how much of it there is: walls go on, windows do not
};

std::vector<Case> cases() {
  return {{"asphalt", {Material::kAsphalt, 7, {0.7F, 1.0F, 0.0F, 0.12F}}, 60.0},
          {"slabs", {Material::kAsphalt, 8, {0.3F, 0.0F, 5.0F, 0.25F}}, 60.0},
          {"marking", {Material::kRoadMarking, 9, {0.5F, 0.12F}}, 30.0},
          {"pavement", {Material::kPavement, 10, {0.0F, 0.3F}}, 20.0},
          {"stones", {Material::kPavement, 11, {1.0F, 0.3F}}, 20.0},
          {"grass", {Material::kGrass, 12, {0.0F}}, 100.0},
          {"field", {Material::kGround, 13, {1.0F, 0.2F}}, 100.0},
          {"foliage", {Material::kFoliage, 14, {0.3F}}, 20.0},
          {"bark", {Material::kBark, 15, {}}, 10.0},
          {"plaster", {Material::kFacade, 16, {0.0F, 0.5F, 9.0F}}, 15.0},
          {"brick", {Material::kFacade, 17, {1.0F, 0.25F, 9.0F}}, 15.0},
          {"stone", {Material::kFacade, 18, {4.0F, 0.4F, 9.0F}}, 15.0},
          {"roof", {Material::kRoof, 19, {0.0F, 0.2F}}, 15.0},
          {"concrete", {Material::kConcrete, 20, {0.0F, 0.35F}}, 20.0},
          {"tunnel", {Material::kTunnelWall, 21, {1.5F, 1.3F, 0.6F, 1.0F}}, 20.0},
          {"rail", {Material::kGuardRail, 22, {}}, 20.0},
          {"fence", {Material::kFence, 23, {1.0F, 0.3F}}, 10.0},
          {"pole", {Material::kPole, 24, {0.3F}}, 10.0},
          {"window", {Material::kWindow, 25, {1.2F, 1.5F, 2.0F, 0.7F}}, 1.2},
          {"shop", {Material::kShopFront, 26, {2.5F, 2.4F}}, 2.4},
          {"door", {Material::kDoor, 27, {1.1F, 2.1F, 0.0F, 0.3F}}, 1.1},
          {"board", {Material::kSign, 28, {4.0F, 2.5F, 5.0F, 1.0F}}, 2.5},
          {"round", {Material::kSign, 29, {0.65F, 0.65F, 0.0F, 1.0F}}, 0.65},
          {"plate", {Material::kPlate, 30, {0.52F, 0.11F}}, 0.11},
          {"car", {Material::kCarBody, 31, {}}, 3.0},
          {"glass", {Material::kCarGlass, 32, {}}, 3.0},
          {"tyre", {Material::kTyre, 33, {}}, 2.0},
          {"lamp", {Material::kLamp, 34, {1.0F}}, 1.0}};
}

struct Statistics {
  double mean = 0.0;
  double deviation = 0.0;
};

Statistics of(const Case& one, float footprint_m) {
  Random random(77);
  constexpr int kCount = 4000;
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < kCount; ++i) {
    const Eigen::Vector2f uv(static_cast<float>(random.uniform(0.0, one.size_m)),
                             static_cast<float>(random.uniform(0.0, one.size_m)));
    const double albedo = static_cast<double>(appearance(one.surface, 5, uv, footprint_m).albedo);
    sum += albedo;
    squares += albedo * albedo;
  }
  const double mean = sum / kCount;
  return {mean, std::sqrt(std::max(0.0, squares / kCount - mean * mean))};
}

TEST(Appearance, StaysInRange) {
  Random random(1);
  for (const Case& one : cases()) {
    for (int i = 0; i < 5000; ++i) {
      const Eigen::Vector2f uv(static_cast<float>(random.uniform(-2000.0, 2000.0)),
                               static_cast<float>(random.uniform(-50.0, 50.0)));
      const auto footprint = static_cast<float>(std::pow(10.0, random.uniform(-5.0, 2.0)));
      const Appearance a = appearance(one.surface, static_cast<std::uint32_t>(i), uv, footprint);
      for (const float value : {a.albedo, a.nir, a.retro, a.gloss}) {
        ASSERT_TRUE(value >= 0.0F && value <= 1.0F) << one.name << " at " << uv.transpose();
      }
      ASSERT_TRUE(a.emission >= 0.0F && std::isfinite(a.emission)) << one.name;
    }
  }
}

// A sooty wall that mirrored the world beyond the portal would show things that stay behind as the
// camera passes: points followed in it miss the wall's own place by tens of pixels.
TEST(Appearance, TunnelWallsMirrorNoImage) {
  const Surface wall{Material::kTunnelWall, 3, {1.5F, 1.3F, 0.6F, 1.05F}};
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2f uv(static_cast<float>(random.uniform(0.0, 200.0)),
                             static_cast<float>(random.uniform(0.0, 3.6)));
    ASSERT_LT(appearance(wall, 0, uv, 0.01F).gloss, kMirrorGloss) << "at " << uv.transpose();
  }
}

TEST(Appearance, FadesToItsMeanWithTheFootprint) {
  for (const Case& one : cases()) {
    if (one.size_m < 5.0) {
      continue;  // a window seen as one pixel is what it is
    }
    const Statistics fine = of(one, 0.001F);
    const Statistics coarse = of(one, 1.0F);
    const Statistics far = of(one, 200.0F);
    EXPECT_NEAR(coarse.mean, fine.mean, 0.15 * fine.mean) << one.name;
    EXPECT_NEAR(far.mean, fine.mean, 0.2 * fine.mean) << one.name;
    EXPECT_LT(coarse.deviation, 0.8 * fine.deviation + 1e-6) << one.name;
    EXPECT_LT(far.deviation, 0.25 * fine.deviation + 0.03 * fine.mean) << one.name;
  }
}

TEST(Appearance, HasFineAndCoarseContrast) {
  for (const Case& one : cases()) {
    const std::string name = one.name;
    if (name == "asphalt" || name == "brick" || name == "pavement" || name == "stone") {
      const Statistics fine = of(one, 0.002F);
      const Statistics coarse = of(one, 0.2F);
      EXPECT_GT(fine.deviation, 0.08 * fine.mean) << name;
      EXPECT_GT(coarse.deviation, 0.03 * coarse.mean) << name;
    }
  }
}

// Luminances of rooms and shops by lamp light, as users of luminance cameras report them.
TEST(Appearance, LitGlassShowsWhatIsBehind) {
  constexpr double kCandelas_m2 = 1e5 / std::numbers::pi;  // of a radiance of 1
  const auto look = [](Material material, std::uint32_t seed, float width, float height) {
    const Surface surface{material, seed, {width, height, 3.0F, 0.3F}};
    std::vector<double> result;
    Random random(seed);
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector2f uv(static_cast<float>(random.uniform(0.1, width - 0.1)),
                               static_cast<float>(random.uniform(0.1, height - 0.1)));
      result.push_back(kCandelas_m2 *
                       static_cast<double>(appearance(surface, 0, uv, 0.01F).emission));
    }
    std::sort(result.begin(), result.end());
    return result;
  };
  int lit = 0;
  Random seeds(1);
  for (int i = 0; i < 100; ++i) {
    const auto seed = static_cast<std::uint32_t>(seeds.next());
    const std::vector<double> shop = look(Material::kShopFront, seed, 2.5F, 2.4F);
    EXPECT_GT(shop[shop.size() / 2], 10.0) << seed;
    EXPECT_LT(shop.back(), 400.0) << seed;
    EXPECT_GT(shop[shop.size() * 9 / 10], 1.5 * shop[shop.size() / 10]) << seed;
    const std::vector<double> room = look(Material::kWindow, seed, 1.2F, 1.5F);
    lit += room.back() > 0.0 ? 1 : 0;
    EXPECT_LT(room.back(), 60.0) << seed;
  }
  EXPECT_GT(lit, 15);
  EXPECT_LT(lit, 45);
}

TEST(Appearance, SeedsTellSurfacesApart) {
  Surface one{Material::kFacade, 1, {1.0F, 0.3F, 9.0F}};
  Surface two = one;
  two.seed = 2;
  int differ = 0;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector2f uv(0.1F * static_cast<float>(i), 2.5F);
    differ += appearance(one, 0, uv, 0.01F).albedo != appearance(two, 0, uv, 0.01F).albedo ? 1 : 0;
  }
  EXPECT_GT(differ, 90);
}

TEST(Appearance, CarsTakeTheirColourFromTheInstance) {
  const Surface body{Material::kCarBody, 1, {}};
  float darkest = 1.0F;
  float lightest = 0.0F;
  for (std::uint32_t car = 0; car < 60; ++car) {
    const float albedo = appearance(body, car, {1.0F, 0.5F}, 0.01F).albedo;
    darkest = std::min(darkest, albedo);
    lightest = std::max(lightest, albedo);
  }
  EXPECT_LT(darkest, 0.06F);
  EXPECT_GT(lightest, 0.6F);
}

TEST(Appearance, ALidarSeesAnotherWorldThanACamera) {
  const auto mean = [](const Surface& surface) {
    Appearance sum{0.0F, 0.0F, 0.0F, 0.0F, 0.0F};
    for (int i = 0; i < 500; ++i) {
      const Appearance a = appearance(
          surface, 0, {0.013F * static_cast<float>(i), 0.007F * static_cast<float>(i)}, 0.01F);
      sum.albedo += a.albedo / 500.0F;
      sum.nir += a.nir / 500.0F;
      sum.retro += a.retro / 500.0F;
    }
    return sum;
  };
  const Appearance leaves = mean({Material::kFoliage, 4, {0.3F}});
  EXPECT_GT(leaves.nir, 3.0F * leaves.albedo);
  EXPECT_GT(mean({Material::kRoadMarking, 4, {0.3F, 0.12F}}).retro, 0.1F);
  EXPECT_GT(mean({Material::kSign, 4, {4.0F, 2.5F, 5.0F, 1.0F}}).retro, 0.2F);
  EXPECT_LT(mean({Material::kWindow, 4, {6.5F, 3.5F, 1.0F, 0.7F}}).nir, 0.15F);
}

}  // namespace
}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/bump.hpp"
#include "world/steps.hpp"
#include "world/world_maker.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::world {
namespace {

constexpr double kKerbTop_m = 0.14;    // width of a kerb stone
constexpr double kKerbFace_m = 0.015;  // it leans back

double signed_side(bool right) { return right ? -1.0 : 1.0; }

// Columns of one direction's carriageway from the middle outwards.
std::vector<Across> carriageway(const Maker& maker, double along_m, bool right) {
  const Profile profile = maker.profile(along_m);
  const auto& widths = right ? profile.right_m : profile.left_m;
  std::vector<double> offsets{profile.median_half_m, profile.median_half_m + profile.inner_m};
  for (int slot = kSlots - 1; slot >= 0; --slot) {
    const double width = widths[static_cast<std::size_t>(slot)];
    offsets.push_back(offsets.back() + 0.5 * width);
    offsets.push_back(offsets.back() + 0.5 * width);
  }
  offsets.push_back(offsets.back() + profile.outer_m);
  offsets.push_back(offsets.back() + profile.parking_m);
  std::vector<Across> result;
  for (const double offset : offsets) {
    const double left_m = signed_side(right) * offset;
    result.push_back({left_m, maker.world.bump_m(along_m, left_m)});
  }
  return result;
}

// Resurfaced every now and then: pieces of asphalt of different age.
void make_asphalt(Maker& maker) {
  Random random(maker.draw(0xA5));
  MeshBuilder builder = maker.unique();
  double begin_m = maker.first_m();
  while (begin_m < maker.last_m()) {
    const Section& section = section_at(maker.world.sections, begin_m);
    const double length_m = random.uniform(60.0, 220.0);
    double end_m = std::min(begin_m + length_m, maker.end_m(section));
    if (maker.last_m() - end_m < 10.0) {
      end_m = maker.last_m();
    }
    const bool town = section.setting == Setting::kTown;
    const bool slabs = section.setting == Setting::kHighway && random.chance(0.3);
    const auto age = static_cast<float>(random.uniform(0.15, 1.0));
    const float tone = slabs ? static_cast<float>(random.uniform(0.22, 0.3))
                             : static_cast<float>(0.07 + 0.09 * age + random.uniform(0.0, 0.02));
    const std::uint32_t surface = builder.surface(
        Material::kAsphalt, random, {age, town ? 1.0F : 0.0F, slabs ? 5.0F : 0.0F, tone});
    for (const bool right : {true, false}) {
      ribbon(
          builder, maker.route(), stations(begin_m, end_m, kStation_m),
          [&](double s) { return carriageway(maker, s, right); }, surface, true);
    }
    begin_m = end_m;
  }
}

// One run of kerb and footway between two openings.
void make_footway(Maker& maker, double begin_m, double end_m, bool right, std::uint64_t seed) {
  MeshBuilder builder = maker.unique();
  Random random(seed);
  const double sign = signed_side(right);
  const std::uint32_t kerb = builder.surface(Material::kConcrete, random, {1.0F, 0.38F});
  const std::uint32_t slabs = builder.surface(
      Material::kPavement, random,
      {static_cast<float>(random.below(3)), static_cast<float>(random.uniform(0.2, 0.42))});
  const std::vector<double> along = stations(begin_m, end_m, 1.0);
  // Lower where a zebra crossing begins.
  const auto height = [&](double s) {
    double share = 1.0;
    for (const double crossing : maker.crossings) {
      share = std::min(share, std::clamp((std::abs(s - crossing) - 1.8) / 1.2, 0.15, 1.0));
    }
    return maker.profile(s).kerb_m * share;
  };
  ribbon(
      builder, maker.route(), along,
      [&](double s) -> std::vector<Across> {
        const double edge = maker.profile(s).edge(right);
        return {{sign * (edge - 0.02), -0.06},
                {sign * edge, height(s) - 0.015},
                {sign * (edge + kKerbFace_m), height(s)},
                {sign * (edge + kKerbTop_m), height(s)}};
      },
      kerb);
  ribbon(
      builder, maker.route(), along,
      [&](double s) -> std::vector<Across> {
        const Profile profile = maker.profile(s);
        const double edge = profile.edge(right);
        const double back = edge + std::max(profile.footway_m, kKerbTop_m);
        const double up = profile.kerb_m;
        return {{sign * (edge + kKerbTop_m), height(s)},
                {sign * std::min(back, edge + 0.9), up},
                {sign * back, up + 0.02},
                {sign * (back + 0.02), up - 0.15}};
      },
      slabs);
}

void make_footways(Maker& maker) {
  constexpr double kStep_m = 0.5;
  for (const bool right : {true, false}) {
    double begin_m = 0.0;
    bool going = false;
    for (const double s : steps(maker.first_m(), maker.last_m() + 1e-9, kStep_m)) {
      const bool has = maker.profile(s).kerb_m > 0.02 && maker.open(s, right, -0.25);
      if (has && !going) {
        begin_m = s;
      }
      const bool ends = going && (!has || s + kStep_m > maker.last_m());
      if (ends && s - begin_m > 1.0) {
        make_footway(maker, begin_m, s, right,
                     maker.draw(0xF007, static_cast<std::uint64_t>(begin_m * 4.0 + 1e5)));
      }
      going = has;
    }
  }
}

void claim_corridor(Maker& maker) {
  for (const double s : steps(maker.first_m(), maker.last_m(), 0.5)) {
    const Profile profile = maker.profile(s);
    const Eigen::Vector2d right =
        maker.world.route.point(s, -profile.edge(true) - profile.footway_m).head<2>();
    const Eigen::Vector2d left =
        maker.world.route.point(s, profile.edge(false) + profile.footway_m).head<2>();
    const Eigen::Vector2d ahead = maker.world.route.T_world_road(s).R.col(0).head<2>() * 0.5;
    maker.site.claim(right, ahead, left - right);
  }
}

}  // namespace

void make_road(Maker& maker) {
  claim_corridor(maker);
  make_asphalt(maker);
  make_footways(maker);
}

}  // namespace topoloc::world

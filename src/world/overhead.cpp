// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/furniture.hpp"
#include "world/steps.hpp"
#include "world/verge.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::world {
namespace {

// A frame over the right carriageway, or over both, with boards for who drives along +x.
void add_gantry(Maker& maker, Random& random, double s) {
  constexpr double kBeam_m = 6.2;
  MeshBuilder builder = maker.unique();
  const Profile profile = maker.profile(s);
  const double right = -profile.edge(true) - 1.3;
  const bool whole = profile.median_half_m < 0.5 || random.chance(0.4);
  const double left = whole ? profile.edge(false) + 1.3 : 0.0;
  const std::uint32_t steel = builder.surface(Material::kPole, random, {0.38F});
  const std::uint32_t back = builder.surface(Material::kPole, random, {0.3F});
  builder.set_frame(maker.upright(s, 0.0));
  for (const double y : {right, left}) {
    builder.bar(Point(0.0, y, -1.0), Point(0.0, y, kBeam_m + 1.1), 0.22, 0.18, 10, steel);
  }
  for (const double z : {kBeam_m, kBeam_m + 1.0}) {
    for (const double x : {-0.3, 0.3}) {
      builder.box(Point(x - 0.06, right, z - 0.06), Point(x + 0.06, left, z + 0.06), steel, true);
    }
  }
  bool up = false;
  for (const double y : steps(right, left - 1.2, 1.2)) {  // lattice
    up = !up;
    builder.bar(Point(-0.3, y, kBeam_m + (up ? 0.0 : 1.0)),
                Point(-0.3, y + 1.2, kBeam_m + (up ? 1.0 : 0.0)), 0.035, 0.035, 4, steel);
  }
  for (const Lane& lane : maker.world.lanes(s)) {
    if (!lane.forward || !random.chance(0.85)) {
      continue;
    }
    const double wide = random.uniform(2.6, 3.3);
    const double high = random.uniform(1.9, 2.7);
    const std::uint32_t face = builder.surface(
        Material::kSign, random, {static_cast<float>(wide), static_cast<float>(high), 5.0F, 1.0F});
    builder.quad(Point(-0.4, lane.left_m + 0.5 * wide, kBeam_m - 0.5), Point(0.0, -wide, 0.0),
                 Point(0.0, 0.0, high), face);
    builder.quad(Point(-0.37, lane.left_m + 0.5 * wide, kBeam_m - 0.5), Point(0.0, -wide, 0.0),
                 Point(0.0, 0.0, high), back);
  }
  builder.set_frame({});
}

// A board on two legs beside the road.
void add_board(Maker& maker, Random& random, double s) {
  MeshBuilder builder = maker.unique();
  const double wide = random.uniform(2.2, 4.2);
  const double high = random.uniform(1.6, 3.0);
  const double out = 2.6 + 0.5 * wide;
  const double ground = verge_m(maker, s, true, out);
  const std::uint32_t steel = builder.surface(Material::kPole, random, {0.36F});
  const std::uint32_t face = builder.surface(
      Material::kSign, random, {static_cast<float>(wide), static_cast<float>(high), 5.0F, 1.0F});
  builder.set_frame(maker.upright(s, -maker.profile(s).edge(true) - out));
  const double low = std::max(1.5, ground + 1.0);
  for (const double y : {-0.3 * wide, 0.3 * wide}) {
    builder.bar(Point(0.08, y, ground - 0.5), Point(0.08, y, low + high), 0.07, 0.07, 8, steel);
  }
  builder.quad(Point(0.0, 0.5 * wide, low), Point(0.0, -wide, 0.0), Point(0.0, 0.0, high), face);
  builder.quad(Point(0.02, 0.5 * wide, low), Point(0.0, -wide, 0.0), Point(0.0, 0.0, high), steel);
  builder.set_frame({});
}

// A road over ours: deck, railing, abutments in the banks, a pier in the median.
void add_bridge(Maker& maker, Random& random, double s) {
  constexpr double kClear_m = 5.6;
  MeshBuilder builder = maker.unique();
  const Profile profile = maker.profile(s);
  const double right = -profile.edge(true) - 5.5;
  const double left = profile.edge(false) + 5.5;
  const double half = random.uniform(3.5, 6.0);
  const std::uint32_t concrete = builder.surface(
      Material::kConcrete, random, {0.0F, static_cast<float>(random.uniform(0.3, 0.42))});
  const std::uint32_t rail = builder.surface(Material::kPole, random, {0.3F});
  builder.set_frame(maker.upright(s, 0.0));
  builder.box(Point(-half, right - 22.0, kClear_m), Point(half, left + 22.0, kClear_m + 1.2),
              concrete, true);
  for (const double x : {-half, half}) {
    builder.box(Point(x - 0.15, right - 22.0, kClear_m + 1.2),
                Point(x + 0.15, left + 22.0, kClear_m + 1.5), concrete);
    for (const double y : steps(right - 22.0, left + 22.0, 1.0)) {
      builder.box(Point(x - 0.02, y, kClear_m + 1.5), Point(x + 0.02, y + 0.05, kClear_m + 2.5),
                  rail);
    }
    builder.box(Point(x - 0.03, right - 22.0, kClear_m + 2.45),
                Point(x + 0.03, left + 22.0, kClear_m + 2.52), rail);
  }
  for (const double y : {right, left}) {
    const double out = y < 0.0 ? -24.0 : 24.0;
    builder.box(Point(-half, std::min(y, y + out), -2.0),
                Point(half, std::max(y, y + out), kClear_m), concrete);
  }
  if (profile.median_half_m > 1.2) {
    for (const double x : {-0.55 * half, 0.55 * half}) {
      builder.bar(Point(x, 0.0, -0.5), Point(x, 0.0, kClear_m), 0.22, 0.22, 14, concrete);
    }
  }
  builder.set_frame({});
}

void add_lamp(Maker& maker, double s, bool right) {
  const double sign = right ? -1.0 : 1.0;
  RigidTransform T = maker.upright(s, sign * (maker.profile(s).edge(right) + 1.4), -0.1);
  if (!right) {
    T.R.col(0) *= -1.0;
    T.R.col(1) *= -1.0;
  }
  maker.put(maker.prototypes.highway_lamp, T,
            maker.draw(0x1A40, static_cast<std::uint64_t>(s + 1e4)));
  Lamp lamp;
  lamp.position_m = T * Point(0.0, kHighwayLampArm_m + 0.2, kHighwayLamp_m + 0.15);
  lamp.intensity = kHighwayLampIntensity;
  lamp.cos_cone = 0.3;
  maker.world.lamps.push_back(lamp);
}

}  // namespace

void make_overhead(Maker& maker, const Section& section, double begin_m, double end_m) {
  Random random(maker.draw(0x0BE2, section.seed));
  MeshBuilder builder = maker.unique();
  double next_gantry = begin_m + random.uniform(35.0, 60.0);
  double next_bridge = begin_m + random.uniform(110.0, 300.0);
  double next_board = begin_m + random.uniform(15.0, 30.0);
  double next_sign = begin_m + random.uniform(5.0, 25.0);
  double lit_until = begin_m + 60.0;  // where a highway begins there is an exit
  double next_lamp = begin_m + 4.0;
  for (const double s : steps(begin_m + 4.0, end_m - 6.0, 1.0)) {
    if (s > next_gantry) {
      add_gantry(maker, random, s);
      next_gantry = s + random.uniform(220.0, 450.0);
      lit_until = std::max(lit_until, s + (random.chance(0.5) ? 120.0 : 0.0));
    } else if (s > next_bridge && s + 12.0 < end_m) {
      add_bridge(maker, random, s);
      next_bridge = s + random.uniform(280.0, 600.0);
    } else if (s > next_board) {
      add_board(maker, random, s);
      next_board = s + random.uniform(90.0, 260.0);
    } else if (s > next_sign) {
      const bool right = random.chance(0.7);
      const double sign = right ? -1.0 : 1.0;
      RigidTransform T = maker.upright(s, sign * (maker.profile(s).edge(right) + 1.5), -0.05);
      if (!right) {
        T.R.col(0) *= -1.0;
        T.R.col(1) *= -1.0;
      }
      builder.set_frame(T);
      const auto shape = static_cast<SignShape>(random.below(3));
      const double size_m = random.uniform(0.6, 0.95);
      add_sign_post(builder, random, random.uniform(2.4, 3.0), size_m, shape);
      builder.set_frame({});
      next_sign = s + random.uniform(40.0, 120.0);
    } else if (s > next_lamp && s < lit_until) {
      add_lamp(maker, s, true);
      add_lamp(maker, s, false);
      next_lamp = s + 30.0;
    }
  }
}

}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/furniture.hpp"
#include "world/steps.hpp"
#include "world/town_lots.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace topoloc::world {
namespace {

constexpr double kLampEvery_m = 30.0;
constexpr double kNearKerb_m = 0.45;

bool clear(const Maker& maker, double s, bool right) {
  return maker.open(s, right, 0.6) && maker.profile(s).footway_m > 2.2;
}

void add_lamp(Maker& maker, double s, bool right, std::uint64_t seed) {
  const double sign = right ? -1.0 : 1.0;
  const Profile profile = maker.profile(s);
  const double left_m = sign * (profile.edge(right) + kNearKerb_m);
  RigidTransform T = maker.upright(s, left_m, profile.kerb_m);
  if (!right) {  // the arm reaches over the road
    T.R.col(0) *= -1.0;
    T.R.col(1) *= -1.0;
  }
  maker.put(maker.prototypes.street_lamp, T, seed);
  Lamp lamp;
  lamp.position_m = T * Point(0.0, kStreetLampArm_m + 0.2, kStreetLamp_m + 0.15);
  lamp.intensity = kStreetLampIntensity;
  lamp.cos_cone = 0.3;
  maker.world.lamps.push_back(lamp);
}

// Facing who drives on that side.
RigidTransform facing(const Maker& maker, double s, double left_m, double up_m, bool right) {
  RigidTransform T = maker.upright(s, left_m, up_m);
  if (!right) {
    T.R.col(0) *= -1.0;
    T.R.col(1) *= -1.0;
  }
  return T;
}

void add_row_things(Maker& maker, const Section& section, bool right) {
  Random random(maker.draw(0xF001, section.seed + (right ? 7 : 8)));
  MeshBuilder builder = maker.unique();
  const double sign = right ? -1.0 : 1.0;
  bool avenue = random.chance(0.6);
  double tree_step_m = random.uniform(9.0, 16.0);
  double next_tree = maker.begin_m(section) + 6.0;
  double next_sign = maker.begin_m(section) + random.uniform(8.0, 20.0);
  double next_thing = maker.begin_m(section) + random.uniform(3.0, 9.0);
  for (const double s : steps(maker.begin_m(section), maker.end_m(section), 1.0)) {
    const Profile profile = maker.profile(s);
    const double kerb = sign * (profile.edge(right) + kNearKerb_m);
    if (!clear(maker, s, right)) {
      continue;
    }
    if (s > next_tree) {
      next_tree = s + tree_step_m * random.uniform(0.85, 1.2);
      if (random.chance(0.06)) {
        avenue = !avenue;
        tree_step_m = random.uniform(9.0, 16.0);
      }
      if (avenue) {
        const auto no_conifers = std::span<const std::uint32_t>(maker.prototypes.trees).first(4);
        maker.put_any(no_conifers, maker.world.route.point(s, kerb + sign * 0.25, profile.kerb_m),
                      random, 0.75, 1.0);
        for (int i = 0; i < 3; ++i) {
          const double at = s + random.uniform(-4.0, 4.0);
          const double left = sign * (profile.edge(right) - random.uniform(0.15, 0.6));
          maker.put(maker.prototypes.litter,
                    maker.upright(at, left, maker.world.bump_m(at, left) + 0.015), random, 0.7,
                    1.3);
        }
      }
    } else if (s > next_sign) {
      next_sign = s + random.uniform(16.0, 42.0);
      builder.set_frame(facing(maker, s, kerb, profile.kerb_m, right));
      const auto shape = static_cast<SignShape>(random.below(3));
      const double size_m = shape == SignShape::kBoard ? random.uniform(0.6, 1.0) : 0.65;
      add_sign_post(builder, random, random.uniform(2.55, 2.9), size_m, shape);
    } else if (s > next_thing) {
      next_thing = s + random.uniform(4.0, 15.0);
      const double wall = sign * (profile.edge(right) + profile.footway_m - 0.4);
      const RigidTransform at_wall = facing(maker, s, wall, profile.kerb_m, right);
      RigidTransform at_kerb = facing(maker, s, kerb, profile.kerb_m, right);
      switch (random.below(6)) {
        case 0:
          for (int i = 0; i < 1 + random.below(3); ++i) {
            RigidTransform T = at_wall;
            T.p = at_wall * Point(0.72 * i, 0.0, 0.0);
            maker.put(maker.prototypes.bin, T, random, 0.9, 1.1);
          }
          break;
        case 1:
          maker.put(maker.prototypes.bench, at_wall, random.next());
          break;
        case 2:
          maker.put(maker.prototypes.cabinet, at_wall, random, 0.8, 1.1);
          break;
        case 3:
          maker.put(maker.prototypes.bicycle_stand, at_kerb, random.next());
          break;
        default:
          for (int i = 0; i < 4; ++i) {
            if (clear(maker, s + 1.6 * i, right)) {
              maker.put(maker.prototypes.bollard, maker.upright(s + 1.6 * i, kerb, profile.kerb_m),
                        random.next());
            }
          }
      }
    }
  }
}

// Grates in the gutter.
void add_drains(Maker& maker, const Section& section, bool right) {
  constexpr double kEvery_m = 22.0;
  constexpr double kLift_m = 0.01;
  MeshBuilder builder = maker.unique();
  Random random(maker.draw(0xD2A1, section.seed + (right ? 3 : 4)));
  const double sign = right ? -1.0 : 1.0;
  const std::uint32_t frame = builder.surface(Material::kPole, 601, {0.13F});
  const std::uint32_t hole = builder.surface(Material::kPole, 602, {0.02F});
  for (const double s : random_steps(random, maker.begin_m(section) + 4.0, maker.end_m(section),
                                     0.8 * kEvery_m, 1.2 * kEvery_m)) {
    if (!clear(maker, s, right)) {
      continue;
    }
    const double left = sign * (maker.profile(s).edge(right) - 0.3);
    builder.set_frame(maker.upright(s, left, maker.world.bump_m(s, left) + kLift_m));
    builder.quad(Point(-0.25, -0.2, 0.0), Point(0.5, 0.0, 0.0), Point(0.0, 0.4, 0.0), frame);
    for (int i = 0; i < 6; ++i) {
      builder.quad(Point(-0.2 + 0.068 * i, -0.15, 0.004), Point(0.035, 0.0, 0.0),
                   Point(0.0, 0.3, 0.0), hole);
    }
  }
}

// Chevrons on the outside of sharp bends.
void add_bend_boards(Maker& maker, const Section& section) {
  constexpr double kSharp_1pm = 0.03;
  MeshBuilder builder = maker.unique();
  for (const double s : steps(maker.begin_m(section), maker.end_m(section), 7.0)) {
    const double curvature = maker.world.route.curvature_1pm(s);
    if (std::abs(curvature) < kSharp_1pm) {
      continue;
    }
    const bool right = curvature > 0.0;  // turns left: they stand on the right
    if (!clear(maker, s, right)) {
      continue;
    }
    const double sign = right ? -1.0 : 1.0;
    const Profile profile = maker.profile(s);
    // Turned towards who comes from before the bend.
    const RigidTransform T = maker.upright(s - 6.0, 0.0);
    RigidTransform board =
        maker.upright(s, sign * (profile.edge(right) + profile.footway_m - 0.3), profile.kerb_m);
    board.R = T.R;
    builder.set_frame(board);
    const std::uint32_t face = builder.surface(Material::kSign, 611, {1.5F, 0.5F, 6.0F, 1.0F});
    const std::uint32_t pole = builder.surface(Material::kPole, 612, {0.35F});
    // Arrows point along u, the way the road turns.
    const double along_m = 1.5 * (right ? 1.0 : -1.0);
    builder.quad(Point(0.0, -0.5 * along_m, 0.75), Point(0.0, along_m, 0.0), Point(0.0, 0.0, 0.5),
                 face);
    for (const double y : {-0.6, 0.6}) {
      builder.bar(Point(0.04, y, -0.2), Point(0.04, y, 1.3), 0.03, 0.03, 6, pole);
    }
  }
}

void add_crossing_things(Maker& maker, const Section& section) {
  Random random(maker.draw(0xC205, section.seed));
  MeshBuilder builder = maker.unique();
  for (const double s : maker.crossings) {
    const Profile profile = maker.profile(s);
    const bool lights = random.chance(0.4);
    for (const bool right : {true, false}) {
      const double sign = right ? -1.0 : 1.0;
      const double at = s + sign * 2.4;  // before the crossing, for the traffic of that side
      if (!clear(maker, at, right)) {
        continue;
      }
      const RigidTransform T =
          facing(maker, at, sign * (profile.edge(right) + 0.5), profile.kerb_m, right);
      if (lights) {
        maker.put(maker.prototypes.traffic_light, T, random.next());
      } else {
        builder.set_frame(T);
        add_sign_post(builder, random, 2.9, 0.7, SignShape::kBoard);
      }
    }
  }
}

}  // namespace

void make_footway_things(Maker& maker, const Section& section) {
  Random random(maker.draw(0x1A3B, section.seed));
  bool right = true;
  for (const double s :
       steps(maker.begin_m(section) + 8.0, maker.end_m(section), 0.5 * kLampEvery_m)) {
    double at = s;
    for (int i = 0; i < 8 && !clear(maker, at, right); ++i) {
      at += 2.0;
    }
    if (clear(maker, at, right)) {
      add_lamp(maker, at, right, random.next());
    }
    right = !right;
  }
  add_row_things(maker, section, true);
  add_row_things(maker, section, false);
  add_crossing_things(maker, section);
  add_drains(maker, section, true);
  add_drains(maker, section, false);
  add_bend_boards(maker, section);
}

}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/furniture.hpp"
#include "world/steps.hpp"
#include "world/tunnel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace topoloc::world {
namespace {

constexpr double kTunnelLampEvery_m = 9.0;
constexpr double kEscapeEvery_m = 25.0;
constexpr double kNicheEvery_m = 75.0;
constexpr double kFanEvery_m = 90.0;
constexpr double kReflectorEvery_m = 12.5;

/// Towards a tunnel's ends more light, so that eyes get used to the dark.
struct Zone {
  double reaches_m;  ///< from the portal
  double intensity;  ///< of each lamp, see Lamp
};

constexpr std::array<Zone, 3> kZones{
    {{40.0, 0.2}, {80.0, 0.07}, {1e9, 0.02}}};  // inside 2000 cd, 10 klm a lamp

// Lamps under the vault, all alike but for how bright they are.
void add_lamps(Maker& maker, const Section& section) {
  MeshBuilder builder = maker.unique();
  const std::uint32_t housing = builder.surface(Material::kPole, 901, {0.4F});
  const Point along(1.2, 0.0, 0.0);
  const Point across(0.0, 0.24, 0.0);
  std::array<std::uint32_t, kZones.size()> lights{};
  for (std::size_t i = 0; i < kZones.size(); ++i) {
    lights[i] =
        builder.surface(Material::kLamp, 902,
                        {lamp_emission(kZones[i].intensity, along.norm() * across.norm()), 1.0F});
  }
  for (const double s : steps(section.begin_m + 3.0, section.end_m, kTunnelLampEvery_m)) {
    const Bore bore = bore_at(maker, s);
    const double from_portal_m = std::min(s - section.begin_m, section.end_m - s);
    std::size_t zone = 0;
    while (from_portal_m > kZones[zone].reaches_m) {
      ++zone;
    }
    for (const double y : {bore.right_m + 1.75, bore.left_m - 1.75}) {
      const double z = bore.roof_m - 0.25;
      builder.set_frame(maker.upright(s, 0.0));
      builder.box(Point(-0.65, y - 0.16, z), Point(0.65, y + 0.16, z + 0.14), housing, true);
      builder.quad(Point(-0.6, y - 0.12, z - 0.006), along, across, lights[zone]);
      Lamp lamp;
      lamp.position_m = maker.upright(s, 0.0) * Point(0.0, y, z - 0.05);
      lamp.intensity = kZones[zone].intensity;
      lamp.cos_cone = 0.1;
      lamp.always_on = true;
      maker.world.lamps.push_back(lamp);
    }
  }
  builder.set_frame({});
}

// Frame on a wall: x along the route, y into the wall.
RigidTransform on_wall(const Maker& maker, double s, bool right, double up_m) {
  const Bore bore = bore_at(maker, s);
  RigidTransform T = maker.upright(s, right ? bore.right_m : bore.left_m, up_m);
  if (right) {
    T.R.col(1) *= -1.0;  // mirrored: only shapes without instances are put here
  }
  return T;
}

void add_escape_signs(Maker& maker, const Section& section, Random& random) {
  MeshBuilder builder = maker.unique();
  for (const double s :
       steps(section.begin_m + 0.5 * kEscapeEvery_m, section.end_m, kEscapeEvery_m)) {
    const std::uint32_t face = builder.surface(Material::kSign, random,
                                               {0.8F, 0.35F, 7.0F, 0.3F});  // its number is its own
    for (const bool right : {true, false}) {
      builder.set_frame(on_wall(maker, s, right, 1.35));
      builder.box(Point(-0.42, -0.06, -0.02), Point(0.42, 0.0, 0.37), face, true);
      builder.quad(Point(-0.4, -0.066, 0.0), Point(0.8, 0.0, 0.0), Point(0.0, 0.0, 0.35), face);
    }
  }
  builder.set_frame({});
}

// An emergency station: a recess painted otherwise, a door, a lamp, a sign across the way.
void add_niches(Maker& maker, const Section& section, Random& random) {
  MeshBuilder builder = maker.unique();
  const std::uint32_t paint = builder.surface(Material::kPole, 911, {0.2F});
  const std::uint32_t inside = builder.surface(Material::kPole, 912, {0.62F});
  const std::uint32_t door = builder.surface(Material::kDoor, 913, {1.1F, 2.1F, 2.0F, 0.3F});
  const std::uint32_t light = builder.surface(Material::kLamp, 914, {0.1F, 1.0F});
  for (const double s :
       steps(section.begin_m + 0.4 * kNicheEvery_m, section.end_m - 6.0, kNicheEvery_m)) {
    const bool right = true;
    builder.set_frame(on_wall(maker, s, right, 0.16));
    // The surround stands out of the wall: what looks like a recess costs no hole.
    builder.box(Point(-1.5, -0.1, 0.0), Point(-1.25, 0.0, 2.7), paint, true);
    builder.box(Point(1.25, -0.1, 0.0), Point(1.5, 0.0, 2.7), paint, true);
    builder.box(Point(-1.5, -0.1, 2.45), Point(1.5, 0.0, 2.7), paint, true);
    builder.quad(Point(-1.25, -0.015, 0.0), Point(2.5, 0.0, 0.0), Point(0.0, 0.0, 2.45), inside);
    builder.quad(Point(-1.05, -0.03, 0.0), Point(1.1, 0.0, 0.0), Point(0.0, 0.0, 2.1), door);
    builder.box(Point(0.35, -0.22, 0.75), Point(0.95, -0.02, 1.75), paint, true);
    builder.quad(Point(-0.5, -0.105, 2.5), Point(1.0, 0.0, 0.0), Point(0.0, 0.0, 0.15), light);
    // Sign at right angles to the wall, seen from afar.
    const std::uint32_t face = builder.surface(Material::kSign, random, {0.6F, 0.6F, 2.0F, 1.0F});
    const Point up(0.0, 0.0, 0.6);
    builder.quad(Point(-1.62, -0.08, 2.7), Point(0.0, -0.6, 0.0), up, face);
    builder.quad(Point(-1.56, -0.68, 2.7), Point(0.0, 0.6, 0.0), up, face);
    builder.box(Point(-1.6, -0.1, 2.95), Point(-1.58, 0.0, 3.0), paint);
  }
  builder.set_frame({});
}

void add_fans(Maker& maker, const Section& section) {
  MeshBuilder builder = maker.unique();
  const std::uint32_t steel = builder.surface(Material::kGuardRail, 921);
  const std::uint32_t dark = builder.surface(Material::kPole, 922, {0.05F});
  for (const double s :
       steps(section.begin_m + 0.7 * kFanEvery_m, section.end_m - 10.0, kFanEvery_m)) {
    const Bore bore = bore_at(maker, s);
    const double middle = 0.5 * (bore.right_m + bore.left_m);
    builder.set_frame(maker.upright(s, 0.0));
    for (const double y : {middle - 0.8, middle + 0.8}) {
      const Point from(-1.5, y, bore.roof_m - 0.62);
      const Point to(1.5, y, bore.roof_m - 0.62);
      builder.bar(from, to, 0.45, 0.45, 16, steel);
      builder.bar(to + Point(-1.8, 0.0, 0.0), from + Point(0.6, 0.0, 0.0), 0.43, 0.43, 12, dark,
                  true);
      for (const double x : {-0.9, 0.9}) {
        builder.box(Point(x - 0.04, y - 0.3, bore.roof_m - 0.3),
                    Point(x + 0.04, y + 0.3, bore.roof_m), steel);
      }
    }
  }
  builder.set_frame({});
}

// Cables along the vault's shoulders, and reflectors along both kerbs.
void add_lines(Maker& maker, const Section& section) {
  MeshBuilder builder = maker.unique();
  const std::uint32_t tray = builder.surface(Material::kGuardRail, 931);
  for (const bool right : {true, false}) {
    ribbon(
        builder, maker.route(), stations(section.begin_m, section.end_m, 2.0),
        [&](double s) -> std::vector<Across> {
          const Bore bore = bore_at(maker, s);
          const double y = right ? bore.right_m + 0.6 : bore.left_m - 0.6;
          const double side = right ? 0.3 : -0.3;
          return {{y, bore.wall_m + 0.55},
                  {y + side, bore.wall_m + 0.5},
                  {y + side, bore.wall_m + 0.6}};
        },
        tray);
    const std::uint32_t eye = builder.surface(Material::kSign, 941, {0.1F, 0.1F, 4.0F, 1.0F});
    const std::uint32_t body = builder.surface(Material::kPole, 942, {0.2F});
    for (const double s : steps(section.begin_m + 2.0, section.end_m, kReflectorEvery_m)) {
      builder.set_frame(on_wall(maker, s, right, 0.55));
      builder.box(Point(-0.03, -0.09, -0.06), Point(0.03, 0.0, 0.06), body, true);
      builder.quad(Point(-0.034, -0.085, -0.05), Point(0.0, 0.08, 0.0), Point(0.0, 0.0, 0.1), eye);
    }
    builder.set_frame({});
  }
}

}  // namespace

void make_tunnel_things(Maker& maker, const Section& section) {
  Random random(maker.draw(0x70BF, section.seed));
  add_lamps(maker, section);
  add_escape_signs(maker, section, random);
  add_niches(maker, section, random);
  add_fans(maker, section);
  add_lines(maker, section);
}

}  // namespace topoloc::world

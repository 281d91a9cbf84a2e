// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/noise.hpp"
#include "world/tunnel.hpp"

#include <cmath>

namespace topoloc::world {
namespace {

constexpr double kWallTop_m = 9.0;
constexpr double kHillHalf_m = 85.0;

// Wall from `low` to `high` across with the bore's outline cut out of it.
void add_opening(MeshBuilder& builder, const Bore& bore, double from_m, double to_m,
                 std::uint32_t concrete) {
  const auto piece = [&](double y0, double y1, double z0, double z1) {
    builder.quad(Point(0.0, y0, z0), Point(0.0, y1 - y0, 0.0), Point(0.0, 0.0, z1 - z0), concrete,
                 Uv(y0, z0));
  };
  piece(from_m, bore.right_m, -3.0, kWallTop_m);
  piece(bore.left_m, to_m, -3.0, kWallTop_m);
  piece(bore.right_m, bore.left_m, bore.roof_m, kWallTop_m);
  for (const bool right : {true, false}) {  // shoulders
    const double y = right ? bore.right_m : bore.left_m;
    const double in = right ? 1.0 : -1.0;
    builder.triangle(Point(0.0, y, bore.wall_m), Point(0.0, y + in * 0.5, bore.wall_m + 0.9),
                     Point(0.0, y, bore.roof_m), concrete);
    builder.triangle(Point(0.0, y + in * 0.5, bore.wall_m + 0.9),
                     Point(0.0, y + in * 1.6, bore.roof_m), Point(0.0, y, bore.roof_m), concrete);
  }
}

void add_portal(Maker& maker, const Section& section, bool entry) {
  MeshBuilder builder = maker.unique();
  Random random(maker.draw(0x90A7, section.seed + (entry ? 1 : 2)));
  const double s = entry ? section.begin_m : section.end_m;
  const Bore bore = bore_at(maker, s);
  const std::uint32_t concrete = builder.surface(
      Material::kConcrete, random, {0.0F, static_cast<float>(random.uniform(0.28, 0.42))});
  const std::uint32_t dark = builder.surface(Material::kPole, random, {0.02F});
  builder.set_frame(maker.upright(s, 0.0));
  const bool tube = maker.profile(s).median_half_m > 0.5;
  const double end_m = tube ? 0.0 : kHillHalf_m;
  add_opening(builder, bore, -kHillHalf_m, end_m, concrete);
  if (tube) {  // the other direction's bore, dark
    Bore other;
    other.right_m = -bore.left_m;
    other.left_m = -bore.right_m;
    add_opening(builder, other, 0.0, kHillHalf_m, concrete);
    const double in = entry ? 25.0 : -25.0;
    builder.quad(Point(in, other.right_m, -1.0), Point(0.0, other.left_m - other.right_m, 0.0),
                 Point(0.0, 0.0, 7.0), dark);
    for (const double y : {other.right_m, other.left_m}) {
      builder.quad(Point(0.0, y, -1.0), Point(in, 0.0, 0.0), Point(0.0, 0.0, 7.0), concrete);
    }
    builder.quad(Point(0.0, other.right_m, bore.roof_m), Point(in, 0.0, 0.0),
                 Point(0.0, other.left_m - other.right_m, 0.0), concrete);
  }
  // Cornice, and the tunnel's name.
  const double out = entry ? -0.35 : 0.35;
  builder.box(Point(std::min(0.0, out), -kHillHalf_m, kWallTop_m - 0.4),
              Point(std::max(0.0, out), kHillHalf_m, kWallTop_m + 0.3), concrete, true);
  const double middle = 0.5 * (bore.left_m + bore.right_m);
  const std::uint32_t face = builder.surface(Material::kSign, random, {4.5F, 0.9F, 2.0F, 0.5F});
  builder.quad(Point(0.2 * out, middle + 2.25, bore.roof_m + 0.8), Point(0.0, -4.5, 0.0),
               Point(0.0, 0.0, 0.9), face);
  builder.set_frame({});
}

// Land over the bore, falling off to both sides.
void add_hill(Maker& maker, const Section& section) {
  MeshBuilder builder = maker.unique();
  const auto seed = static_cast<std::uint32_t>(maker.draw(0x4111, section.seed));
  const std::uint32_t grass = builder.surface(Material::kGrass, seed, {0.0F, 0.0F});
  const auto height = [&](double s, double y) {
    const double inside = std::min(s - section.begin_m, section.end_m - s);
    const double rise = 16.0 * (1.0 - std::exp(-std::max(0.0, inside) / 30.0));
    const double side = std::max(0.0, 1.0 - std::pow(std::abs(y) / kHillHalf_m, 2.0));
    const double bumps =
        noise::value(static_cast<float>(s / 22.0), static_cast<float>(y / 22.0), seed);
    return kWallTop_m - 0.5 + rise * (0.4 + 0.6 * side) +
           4.0 * (bumps - 0.3) * std::min(1.0, inside / 15.0) * side;
  };
  ribbon(
      builder, maker.route(), stations(section.begin_m, section.end_m, 5.0),
      [&](double s) {
        std::vector<Across> points;
        for (int i = -10; i <= 10; ++i) {
          const double y = kHillHalf_m * i / 10.0;
          points.push_back({y, height(s, y)});
        }
        points.insert(points.begin(), {-kHillHalf_m - 6.0, -8.0});
        points.push_back({kHillHalf_m + 6.0, -8.0});
        return points;
      },
      grass);
  Random random(maker.draw(0x4112, section.seed));
  const double length_m = section.end_m - section.begin_m;
  for (int i = 0; i < 90 + static_cast<int>(length_m * 0.4); ++i) {
    // Only near the ends: nobody sees what stands on the middle of the hill.
    const double from_end = std::min(0.5 * length_m, 4.0 + 70.0 * random.uniform());
    const double s = random.chance(0.5) ? section.begin_m + from_end : section.end_m - from_end;
    const double y = random.uniform(-0.9, 0.9) * kHillHalf_m;
    const bool bush = random.chance(0.5);
    const auto& meshes = bush ? maker.prototypes.bushes : maker.prototypes.trees;
    maker.put_any(meshes, maker.world.route.point(s, y, height(s, y) - 0.5), random, 0.6, 1.2);
  }
}

}  // namespace

void make_portals(Maker& maker, const Section& section) {
  add_portal(maker, section, true);
  add_portal(maker, section, false);
  add_hill(maker, section);
}

}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/noise.hpp"
#include "world/world_maker.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::world {
namespace {

constexpr double kGrid_m = 14.0;
constexpr double kAround_m = 750.0;

double smooth(double x, double from, double to) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

double hills(std::uint32_t seed, double x, double y) {
  double height = 0.0;
  double cell_m = 260.0;
  double size = 1.0;
  for (std::uint32_t i = 0; i < 4; ++i) {
    height += size * (noise::value(static_cast<float>(x / cell_m), static_cast<float>(y / cell_m),
                                   seed + i) -
                      0.35);
    cell_m *= 0.45;
    size *= 0.42;
  }
  return height;
}

double height_at(const Maker& maker, const Eigen::Vector2d& p) {
  const Site::Nearest nearest = maker.site.nearest(p);
  const double d = nearest.distance_m;
  const Setting setting = section_at(maker.world.sections, nearest.along_m).setting;
  // Under roads and verges the grid lies low: what it cannot follow must not show.
  const double below_m = setting == Setting::kTown ? 1.4 : 4.0;
  const double reach_m = setting == Setting::kTown ? 56.0 : 48.0;
  const auto seed = static_cast<std::uint32_t>(maker.world.spec.seed);
  const double rise = smooth(d, reach_m, 480.0) * 55.0 + smooth(d, 250.0, 900.0) * 60.0;
  const double hill = hills(seed, p.x(), p.y());
  // Hills over a tunnel.
  const double over = setting == Setting::kTunnel ? 14.0 * smooth(d, 30.0, 70.0) : 0.0;
  return maker.site.land_m(p) - below_m * (1.0 - smooth(d, reach_m, reach_m + 25.0)) + rise * hill +
         over;
}

void plant_woods(Maker& maker, const std::vector<double>& heights, int columns,
                 const Eigen::Vector2d& low) {
  const int rows = static_cast<int>(heights.size()) / columns;
  const auto seed = static_cast<std::uint32_t>(maker.world.spec.seed) + 77U;
  for (int j = 0; j + 1 < rows; ++j) {
    for (int i = 0; i + 1 < columns; ++i) {
      Random random(maker.draw(
          0x300D, static_cast<std::uint64_t>(j) * 100000U + static_cast<std::uint64_t>(i)));
      const double fx = random.uniform();
      const double fy = random.uniform();
      const Eigen::Vector2d p = low + kGrid_m * Eigen::Vector2d(i + fx, j + fy);
      const double wood =
          noise::value(static_cast<float>(p.x() / 90.0), static_cast<float>(p.y() / 90.0), seed);
      if (!random.chance(wood > 0.55 ? 0.85 : 0.06)) {
        continue;
      }
      const Site::Nearest nearest = maker.site.nearest(p);
      const Setting setting = section_at(maker.world.sections, nearest.along_m).setting;
      const double keep_m = setting == Setting::kHighway ? 24.0 : 32.0;
      if (nearest.distance_m < keep_m || nearest.distance_m > kAround_m || !maker.site.is_free(p)) {
        continue;
      }
      if (setting == Setting::kTunnel && nearest.distance_m < 80.0) {
        continue;
      }
      const auto at = [&](int di, int dj) {
        return heights[static_cast<std::size_t>(j + dj) * static_cast<std::size_t>(columns) +
                       static_cast<std::size_t>(i + di)];
      };
      const double z =
          std::lerp(std::lerp(at(0, 0), at(1, 0), fx), std::lerp(at(0, 1), at(1, 1), fx), fy);
      constexpr double kNear_m = 60.0;
      const auto& woods =
          nearest.distance_m < kNear_m ? maker.prototypes.trees : maker.prototypes.woods;
      maker.put_any(woods, Point(p.x(), p.y(), z - 0.3), random, 0.6, 1.15);
    }
  }
}

}  // namespace

void make_terrain(Maker& maker) {
  const Eigen::Vector2d low = maker.site.low() - Eigen::Vector2d::Constant(kAround_m);
  const Eigen::Vector2d size =
      maker.site.high() - maker.site.low() + Eigen::Vector2d::Constant(2.0 * kAround_m);
  const int columns = static_cast<int>(size.x() / kGrid_m) + 1;
  const int rows = static_cast<int>(size.y() / kGrid_m) + 1;
  MeshBuilder builder = maker.unique();
  builder.set_frame({});
  const std::uint32_t grass = builder.surface(
      Material::kGrass, static_cast<std::uint32_t>(maker.draw(0x9255)), {0.0F, 0.0F});
  const std::uint32_t field = builder.surface(
      Material::kGround, static_cast<std::uint32_t>(maker.draw(0xF1E1)), {1.0F, 0.22F});
  std::vector<double> heights;
  heights.reserve(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  std::vector<std::uint32_t> vertices;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const Eigen::Vector2d p = low + kGrid_m * Eigen::Vector2d(i, j);
      heights.push_back(height_at(maker, p));
      vertices.push_back(builder.vertex(Point(p.x(), p.y(), heights.back()), p));
    }
  }
  for (int j = 0; j + 1 < rows; ++j) {
    for (int i = 0; i + 1 < columns; ++i) {
      const auto at = [&](int di, int dj) {
        return vertices[static_cast<std::size_t>(j + dj) * static_cast<std::size_t>(columns) +
                        static_cast<std::size_t>(i + di)];
      };
      // Fields of some 100 m.
      const bool ploughed =
          noise::unit(static_cast<std::uint32_t>(i / 7), static_cast<std::uint32_t>(j / 9),
                      static_cast<std::uint32_t>(maker.world.spec.seed)) > 0.65F;
      builder.face(at(0, 0), at(1, 0), at(1, 1), at(0, 1), ploughed ? field : grass);
    }
  }
  plant_woods(maker, heights, columns, low);
}

}  // namespace topoloc::world

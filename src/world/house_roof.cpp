// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/house.hpp"

#include <cmath>

namespace topoloc::world {
namespace {

constexpr double kOverhang_m = 0.4;

void add_chimney(MeshBuilder& builder, Random& random, const Point& foot, double height_m) {
  const std::uint32_t brick = builder.surface(Material::kFacade, random, {1.0F, 0.2F, 3.0F});
  const double half = random.uniform(0.25, 0.45);
  builder.box(foot - Point(half, 0.3, 1.5), foot + Point(half, 0.3, height_m), brick);
  builder.box(foot + Point(-half - 0.06, -0.36, height_m - 0.1),
              foot + Point(half + 0.06, 0.36, height_m), brick, true);
}

void add_dormer(MeshBuilder& builder, Random& random, double x, double y, double z, double pitch,
                std::uint32_t roof, std::uint32_t wall) {
  const double half = random.uniform(0.6, 0.85);
  const double height = 1.35;
  const double depth = height / pitch;
  const std::uint32_t pane = builder.surface(
      Material::kWindow, random,
      {static_cast<float>(2.0 * half - 0.3), 1.0F, static_cast<float>(random.below(5)), 0.7F});
  builder.quad(Point(x - half, y, z), Point(2.0 * half, 0.0, 0.0), Point(0.0, 0.0, height), wall);
  builder.quad(Point(x - half + 0.15, y - 0.02, z + 0.2), Point(2.0 * half - 0.3, 0.0, 0.0),
               Point(0.0, 0.0, 1.0), pane);
  const Point top(x, y - 0.15, z + height + 0.45);
  for (const double sign : {-1.0, 1.0}) {
    builder.triangle(Point(x + sign * half, y, z), Point(x + sign * half, y, z + height),
                     Point(x + sign * half, y + depth, z + height), wall);
    builder.corners(Point(x + sign * (half + 0.15), y - 0.15, z + height - 0.05),
                    Point(x + sign * (half + 0.15), y + depth, z + height - 0.05),
                    top + Point(0.0, depth + 0.6, 0.0), top, roof);
  }
  builder.triangle(Point(x - half, y, z + height), Point(x + half, y, z + height),
                   Point(x, y, z + height + 0.42), wall);
}

void add_flat_roof(MeshBuilder& builder, Random& random, const HouseForm& form, double eave_m,
                   std::uint32_t wall, std::uint32_t roof) {
  const double w = form.width_m;
  const double d = form.depth_m;
  const double parapet = random.uniform(0.4, 0.9);
  builder.quad(Point(0.0, 0.0, eave_m), Point(w, 0.0, 0.0), Point(0.0, d, 0.0), roof);
  builder.box(Point(-0.04, -0.1, eave_m), Point(w + 0.04, 0.15, eave_m + parapet), wall, true);
  builder.box(Point(0.0, d - 0.15, eave_m), Point(w, d, eave_m + parapet), wall);
  builder.box(Point(-0.04, 0.0, eave_m), Point(0.15, d, eave_m + parapet), wall);
  builder.box(Point(w - 0.15, 0.0, eave_m), Point(w + 0.04, d, eave_m + parapet), wall);
  for (int i = random.below(3); i >= 0; --i) {  // lift shaft, ducts
    const double back = random.uniform(2.0, d - 2.0);
    const Point at(random.uniform(1.0, w - 1.0), back, eave_m);
    builder.box(at - Point(0.7, 0.9, 0.0), at + Point(0.7, 0.9, random.uniform(0.7, 2.2)), roof);
  }
}

}  // namespace

void add_roof(MeshBuilder& builder, Random& random, const HouseForm& form, double eave_m,
              std::uint32_t wall) {
  const std::uint32_t roof = builder.surface(
      Material::kRoof, random,
      {static_cast<float>(random.below(3)), static_cast<float>(random.uniform(0.1, 0.3))});
  if (form.flat_roof) {
    add_flat_roof(builder, random, form, eave_m, wall, roof);
    return;
  }
  const double w = form.width_m;
  const double d = form.depth_m;
  const double pitch = std::tan(random.uniform(0.5, 0.85));
  const bool gable_front = form.detached ? random.chance(0.45) : random.chance(0.2);
  if (gable_front) {
    const double ridge = eave_m + 0.5 * w * pitch;
    const double over = kOverhang_m;
    const Point top_front(0.5 * w, -over, ridge);
    const Point top_back(0.5 * w, d + 0.2, ridge);
    for (const double side : {0.0, w}) {
      const double out = form.detached ? (side > 0.0 ? over : -over) : 0.0;
      const double low = eave_m - std::abs(out) * pitch;
      builder.corners(Point(side + out, -over, low), Point(side + out, d + 0.2, low), top_back,
                      top_front, roof);
    }
    builder.triangle(Point(0.0, 0.0, eave_m), Point(w, 0.0, eave_m), Point(0.5 * w, 0.0, ridge),
                     wall, Uv(0.0, eave_m));
    builder.triangle(Point(0.0, d, eave_m), Point(w, d, eave_m), Point(0.5 * w, d, ridge), wall);
    const std::uint32_t pane = builder.surface(Material::kWindow, random, {1.0F, 1.2F, 0.0F, 0.7F});
    builder.quad(Point(0.5 * w - 0.5, -0.02, eave_m + 0.4), Point(1.0, 0.0, 0.0),
                 Point(0.0, 0.0, 1.2), pane);
    if (random.chance(0.7)) {
      add_chimney(builder, random, Point(0.3 * w, 0.5 * d, ridge - 0.2 * w * pitch), 1.6);
    }
    return;
  }
  const double ridge = eave_m + 0.5 * d * pitch;
  const double low = eave_m - kOverhang_m * pitch;
  builder.corners(Point(-0.1, -kOverhang_m, low), Point(w + 0.1, -kOverhang_m, low),
                  Point(w + 0.1, 0.5 * d, ridge), Point(-0.1, 0.5 * d, ridge), roof);
  builder.corners(Point(-0.1, d + 0.3, low), Point(w + 0.1, d + 0.3, low),
                  Point(w + 0.1, 0.5 * d, ridge), Point(-0.1, 0.5 * d, ridge), roof);
  for (const double x : {0.0, w}) {
    builder.triangle(Point(x, 0.0, eave_m), Point(x, d, eave_m), Point(x, 0.5 * d, ridge), wall,
                     Uv(0.0, eave_m));
  }
  // Gutter along the eave.
  const std::uint32_t gutter = builder.surface(Material::kPole, random, {0.25F});
  builder.bar(Point(-0.1, -kOverhang_m - 0.02, low + 0.02),
              Point(w + 0.1, -kOverhang_m - 0.02, low + 0.02), 0.07, 0.07, 5, gutter);
  for (int i = 1 + random.below(2); i > 0; --i) {
    if (random.chance(0.75)) {
      const double y = random.uniform(0.35, 0.65) * d;
      const double z = eave_m + std::min(y, d - y) * pitch;
      add_chimney(builder, random, Point(random.uniform(0.15, 0.85) * w, y, z), 1.5);
    }
  }
  if (random.chance(0.5) && pitch > 0.6) {
    const int count = std::max(1, static_cast<int>(w / 4.0));
    for (int i = 0; i < count; ++i) {
      const double y = 0.9;
      add_dormer(builder, random, w * (i + 0.5) / count, y, eave_m + y * pitch, pitch, roof, wall);
    }
  }
}

}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/house.hpp"
#include "world/steps.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::world {
namespace {

// Wall of a bay around a hole, uv by the wall's own metres so that bricks go on.
void wall_around(MeshBuilder& builder, double x, double z, double width, double height, double x0,
                 double x1, double z0, double z1, std::uint32_t wall) {
  const auto piece = [&](double from_x, double to_x, double from_z, double to_z) {
    if (to_x - from_x > 1e-4 && to_z - from_z > 1e-4) {
      builder.quad(Point(from_x, 0.0, from_z), Point(to_x - from_x, 0.0, 0.0),
                   Point(0.0, 0.0, to_z - from_z), wall, Uv(from_x, from_z));
    }
  };
  piece(x, x + width, z, z0);
  piece(x, x + width, z1, z + height);
  piece(x, x0, z0, z1);
  piece(x1, x + width, z0, z1);
}

// The four sides of a hole in a wall.
void reveal(MeshBuilder& builder, double x0, double x1, double z0, double z1, double depth,
            std::uint32_t surface) {
  const Point in(0.0, depth, 0.0);
  builder.quad(Point(x0, 0.0, z0), Point(x1 - x0, 0.0, 0.0), in, surface);
  builder.quad(Point(x0, 0.0, z1), Point(x1 - x0, 0.0, 0.0), in, surface);
  builder.quad(Point(x0, 0.0, z0), Point(0.0, 0.0, z1 - z0), in, surface);
  builder.quad(Point(x1, 0.0, z0), Point(0.0, 0.0, z1 - z0), in, surface);
}

std::uint32_t pane(MeshBuilder& builder, Random& random, double width, double height, int layout,
                   float frame_tone) {
  return builder.surface(Material::kWindow, random,
                         {static_cast<float>(width), static_cast<float>(height),
                          static_cast<float>(layout), frame_tone});
}

}  // namespace

void add_window_bay(MeshBuilder& builder, Random& random, double x_m, double z_m, double width_m,
                    double height_m, const WindowStyle& style, std::uint32_t wall) {
  const double half = 0.5 * std::min(style.width_m, width_m - 0.3);
  const double middle = x_m + 0.5 * width_m;
  const double x0 = middle - half;
  const double x1 = middle + half;
  const double z0 = z_m + style.sill_m;
  const double z1 = std::min(z0 + style.height_m, z_m + height_m - 0.1);
  wall_around(builder, x_m, z_m, width_m, height_m, x0, x1, z0, z1, wall);
  reveal(builder, x0, x1, z0, z1, style.recess_m, style.frame_surface);
  builder.quad(Point(x0, style.recess_m, z0), Point(x1 - x0, 0.0, 0.0), Point(0.0, 0.0, z1 - z0),
               pane(builder, random, x1 - x0, z1 - z0, style.layout, style.frame_tone));
  // Frame and middle bar stand out of the glass.
  const std::uint32_t frame = style.frame_surface;
  if (style.layout % 2 == 0) {
    builder.box(Point(middle - 0.035, style.recess_m - 0.035, z0),
                Point(middle + 0.035, style.recess_m, z1), frame);
  }
  builder.box(Point(x0 - 0.06, -0.09, z0 - 0.06), Point(x1 + 0.06, 0.02, z0), frame, true);
  if (style.lintel) {
    builder.box(Point(x0 - 0.1, -0.035, z1), Point(x1 + 0.1, 0.0, z1 + 0.14), frame, true);
  }
  if (style.shutters && style.sill_m > 0.3) {
    const double wide = half * 0.9;
    for (const double at : {x0 - wide - 0.02, x1 + 0.02}) {
      builder.box(Point(at, -0.05, z0), Point(at + wide, 0.0, z1), style.shutter_surface, true);
    }
  } else if (style.sill_m > 0.3 && random.chance(0.12)) {  // flower box
    const std::uint32_t flowers = builder.surface(Material::kFoliage, random, {0.2F});
    builder.box(Point(x0, -0.24, z0), Point(x1, -0.07, z0 + 0.16), style.shutter_surface, true);
    for (const double x : steps(x0, x1 - 0.1, 0.12)) {
      const double up = random.uniform(0.25, 0.42);
      const Point tip(x + random.uniform(0.0, 0.15), -0.22, z0 + up);
      builder.triangle(Point(x, -0.2, z0 + 0.15), Point(x + 0.16, -0.12, z0 + 0.15), tip, flowers);
    }
  }
}

void add_door_bay(MeshBuilder& builder, Random& random, double x_m, double width_m, double height_m,
                  std::uint32_t wall, std::uint32_t frame) {
  const double half = 0.5 * std::min(random.uniform(1.0, 1.5), width_m - 0.3);
  const double middle = x_m + 0.5 * width_m;
  const double x0 = middle - half;
  const double x1 = middle + half;
  const double step_m = 0.3;
  const double top_m = std::min(step_m + random.uniform(2.1, 2.5), height_m - 0.2);
  wall_around(builder, x_m, 0.0, width_m, height_m, x0, x1, 0.0, top_m, wall);
  reveal(builder, x0, x1, 0.0, top_m, 0.28, frame);
  const std::uint32_t door = builder.surface(
      Material::kDoor, random,
      {static_cast<float>(x1 - x0), static_cast<float>(top_m - step_m),
       static_cast<float>(random.below(4)), static_cast<float>(random.uniform(0.05, 0.45))});
  builder.quad(Point(x0, 0.28, step_m), Point(x1 - x0, 0.0, 0.0), Point(0.0, 0.0, top_m - step_m),
               door);
  for (int i = 0; i < 2; ++i) {  // steps
    builder.box(Point(x0 - 0.1, -0.5 + 0.3 * i, 0.15 * i - 0.3),
                Point(x1 + 0.1, 0.28, 0.15 * (i + 1)), frame);
  }
  if (random.chance(0.45)) {  // canopy
    builder.box(Point(x0 - 0.3, -0.58, top_m + 0.12), Point(x1 + 0.3, 0.0, top_m + 0.22), frame,
                true);
  }
  const std::uint32_t plate = builder.surface(
      Material::kSign, random, {0.3F, 0.22F, 1.0F, 0.0F});  // the number of the house
  builder.quad(Point(x1 + 0.16, -0.015, 1.75), Point(0.3, 0.0, 0.0), Point(0.0, 0.0, 0.22), plate);
}

void add_shop_front(MeshBuilder& builder, Random& random, double width_m, double height_m,
                    std::uint32_t wall) {
  const std::uint32_t frame = builder.surface(
      Material::kFence, random, {0.0F, static_cast<float>(random.uniform(0.05, 0.6))});
  const double board_m = random.uniform(0.55, 0.85);
  const double top_m = height_m - board_m - 0.25;
  const int bays = std::max(2, static_cast<int>(width_m / random.uniform(2.2, 3.2)));
  const double bay_m = width_m / bays;
  const int door = random.below(bays);
  for (int bay = 0; bay < bays; ++bay) {
    const double x = bay * bay_m;
    const bool is_door = bay == door;
    const double sill_m = is_door ? 0.06 : random.uniform(0.35, 0.6);
    const double in_m = is_door ? 0.5 : 0.16;
    wall_around(builder, x, 0.0, bay_m, top_m, x + 0.14, x + bay_m - 0.14, sill_m, top_m, wall);
    reveal(builder, x + 0.14, x + bay_m - 0.14, sill_m, top_m, in_m, frame);
    const std::uint32_t glass = builder.surface(
        is_door ? Material::kWindow : Material::kShopFront, random,
        {static_cast<float>(bay_m - 0.28), static_cast<float>(top_m - sill_m), 3.0F, 0.3F});
    builder.quad(Point(x + 0.14, in_m, sill_m), Point(bay_m - 0.28, 0.0, 0.0),
                 Point(0.0, 0.0, top_m - sill_m), glass);
    builder.box(Point(x + bay_m - 0.07, -0.04, 0.0), Point(x + bay_m + 0.07, 0.0, top_m), frame);
  }
  builder.quad(Point(0.0, 0.0, top_m), Point(width_m, 0.0, 0.0), Point(0.0, 0.0, height_m - top_m),
               wall, Uv(0.0, top_m));
  const double sign_m = random.uniform(0.55, 0.9) * width_m;
  const double sign_x = random.uniform(0.1, width_m - sign_m - 0.1);
  const std::uint32_t board =
      builder.surface(Material::kSign, random,
                      {static_cast<float>(sign_m), static_cast<float>(board_m), 2.0F, 1.0F});
  builder.quad(Point(sign_x, -0.12, top_m + 0.12), Point(sign_m, 0.0, 0.0),
               Point(0.0, 0.0, board_m), board);
  builder.box(Point(sign_x - 0.04, -0.115, top_m + 0.08),
              Point(sign_x + sign_m + 0.04, 0.0, top_m + 0.16 + board_m), frame, true);
  if (random.chance(0.45)) {  // awning
    const std::uint32_t cloth = builder.surface(
        Material::kFence, random, {2.0F, static_cast<float>(random.uniform(0.15, 0.7))});
    const double out = random.uniform(0.8, 1.2);
    const double low_m = std::max(2.45, top_m - 0.5);
    builder.corners(Point(0.3, -out, low_m), Point(width_m - 0.3, -out, low_m),
                    Point(width_m - 0.3, -0.02, top_m + 0.1), Point(0.3, -0.02, top_m + 0.1),
                    cloth);
    builder.quad(Point(0.3, -out, low_m - 0.22), Point(width_m - 0.6, 0.0, 0.0),
                 Point(0.0, 0.0, 0.22), cloth);
  }
  if (random.chance(0.5)) {  // a sign that sticks out, seen along the street
    const std::uint32_t arm = builder.surface(Material::kSign, random, {0.7F, 0.9F, 2.0F, 1.0F});
    const double x = random.uniform(0.4, width_m - 0.4);
    const Point up(0.0, 0.0, 0.9);
    builder.quad(Point(x, -0.25, height_m - 0.1), Point(0.0, -0.7, 0.0), up, arm);
    builder.quad(Point(x + 0.09, -0.95, height_m - 0.1), Point(0.0, 0.7, 0.0), up, arm);
    builder.box(Point(x, -0.25, height_m + 0.7), Point(x + 0.09, 0.0, height_m + 0.76), frame,
                true);
  }
}

void add_balcony(MeshBuilder& builder, Random& random, double x_m, double z_m, double width_m,
                 std::uint32_t slab) {
  const double out = random.uniform(0.75, 1.1);
  builder.box(Point(x_m, -out, z_m - 0.12), Point(x_m + width_m, 0.0, z_m + 0.04), slab, true);
  const std::uint32_t rail =
      builder.surface(Material::kPole, random, {static_cast<float>(random.uniform(0.05, 0.3))});
  const double top = z_m + 1.02;
  builder.box(Point(x_m, -out, top - 0.05), Point(x_m + width_m, -out + 0.05, top), rail, true);
  for (const double x : {x_m, x_m + width_m - 0.05}) {
    builder.box(Point(x, -out, top - 0.05), Point(x + 0.05, 0.0, top), rail, true);
  }
  for (const double x : steps(x_m, x_m + width_m, 0.13)) {
    builder.quad(Point(x, -out + 0.02, z_m), Point(0.025, 0.0, 0.0), Point(0.0, 0.0, 1.0), rail);
  }
}

}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/plants.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace topoloc::world {
namespace {

Point random_direction(Random& random) {
  const double z = random.uniform(-1.0, 1.0);
  const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

Uv random_uv(Random& random, double side_m) {
  const double up = random.uniform(0.0, side_m);
  return {random.uniform(0.0, side_m), up};
}

}  // namespace

void add_leaf(MeshBuilder& builder, Random& random, const Point& middle, double size_m,
              std::uint32_t surface) {
  const Point normal = random_direction(random);
  const Point x = normal.unitOrthogonal() * size_m;
  const Point y = normal.cross(x) * random.uniform(0.7, 1.1);
  // A kite: less like a tile than a rectangle, for the same two triangles.
  builder.corners(middle - x, middle - 0.5 * y, middle + x, middle + 0.5 * y, surface,
                  random_uv(random, 20.0));
}

void add_tree(MeshBuilder& builder, Random& random, const TreeForm& form) {
  const std::uint32_t bark = builder.surface(Material::kBark, random);
  const std::uint32_t leaves[] = {builder.surface(Material::kFoliage, random, {0.0F}),
                                  builder.surface(Material::kFoliage, random, {0.35F}),
                                  builder.surface(Material::kFoliage, random, {0.7F})};
  const double trunk_m = form.height_m * form.trunk_share;
  const double fork_y = random.uniform(-0.15, 0.15);
  const Point fork(random.uniform(-0.15, 0.15), fork_y, trunk_m);
  builder.bar(Point(0.0, 0.0, -0.3), fork, form.trunk_radius_m, 0.75 * form.trunk_radius_m,
              form.sides, bark);
  const double crown_m = form.height_m - trunk_m;
  const Point middle(fork.x(), fork.y(), trunk_m + 0.5 * crown_m);
  // Branches carry blobs of leaves; a crown of one ball would look like a toy.
  for (int i = 0; i < form.blobs; ++i) {
    const double angle = 2.4 * i + random.uniform(-0.4, 0.4);
    const double level = (i + 0.5) / form.blobs;
    const double reach = form.conifer
                             ? form.radius_m * (1.05 - level)
                             : form.radius_m * 0.62 *
                                   std::sqrt(std::max(0.05, 1.0 - std::pow(2.0 * level - 0.85, 2)));
    const Point blob(middle.x() + reach * std::cos(angle), middle.y() + reach * std::sin(angle),
                     trunk_m + crown_m * (form.conifer ? level * 0.97 : 0.12 + 0.76 * level));
    const Point from =
        form.conifer ? Point(fork.x(), fork.y(), blob.z() + 0.2)
                     : fork + Point(0.0, 0.0, 0.35 * crown_m * level * random.uniform(0.3, 1.0));
    if (form.sides > 3) {
      builder.bar(from, blob, 0.2 * form.trunk_radius_m, 0.012, 4, bark);
    }
    const double size_m = form.conifer ? form.radius_m * (0.6 - 0.5 * level) + 0.15
                                       : form.radius_m * random.uniform(0.36, 0.6);
    for (int k = 0; k < form.leaves / form.blobs; ++k) {
      const Point out = random_direction(random);
      const double distance = size_m * std::cbrt(random.uniform(0.15, 1.0));
      Point at = blob + distance * out;
      at.z() -= (form.conifer ? 0.6 : 0.25) * distance * std::abs(out.x());
      const std::uint32_t shade = leaves[random.below(3)];
      add_leaf(builder, random, at, form.leaf_m * random.uniform(0.7, 1.3), shade);
    }
  }
  if (form.conifer) {
    builder.bar(fork, Point(fork.x(), fork.y(), form.height_m), 0.7 * form.trunk_radius_m, 0.02, 4,
                bark);
  }
}

void add_bush(MeshBuilder& builder, Random& random, double radius_m, double height_m, int leaves) {
  const std::uint32_t foliage[] = {builder.surface(Material::kFoliage, random, {0.1F}),
                                   builder.surface(Material::kFoliage, random, {0.5F})};
  for (int k = 0; k < leaves; ++k) {
    const Point out = random_direction(random);
    const double distance = std::cbrt(random.uniform(0.3, 1.0));
    const Point at(radius_m * distance * out.x(), radius_m * distance * out.y(),
                   height_m * (0.5 + 0.5 * distance * out.z()));
    const std::uint32_t shade = foliage[random.below(2)];
    add_leaf(builder, random, at, random.uniform(0.08, 0.2), shade);
  }
}

void add_hedge(MeshBuilder& builder, Random& random, double length_m, double height_m) {
  const std::uint32_t inside = builder.surface(Material::kFoliage, random, {0.9F});
  const std::uint32_t foliage = builder.surface(Material::kFoliage, random, {0.25F});
  const double half = 0.5 * length_m;
  builder.box(Point(-half, -0.22, 0.0), Point(half, 0.22, height_m - 0.06), inside);
  for (int k = 0; k < static_cast<int>(170.0 * length_m); ++k) {
    const int side = random.below(5);
    const double up = random.uniform(0.03, height_m);
    const double left = random.uniform(-0.27, 0.27);
    Point at(random.uniform(-half, half), left, up);
    if (side < 2) {
      at.y() = -0.25 + random.uniform(-0.04, 0.04);
    } else if (side < 4) {
      at.y() = 0.25 + random.uniform(-0.04, 0.04);
    } else {
      at.z() = height_m + random.uniform(-0.05, 0.06);
    }
    add_leaf(builder, random, at, random.uniform(0.05, 0.11), foliage);
  }
}

void add_litter(MeshBuilder& builder, Random& random, double radius_m, int leaves) {
  const std::uint32_t foliage[] = {builder.surface(Material::kFoliage, random, {0.8F}),
                                   builder.surface(Material::kBark, random)};
  for (int k = 0; k < leaves; ++k) {
    const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double distance = radius_m * random.uniform();
    const Point at(distance * std::cos(angle), 0.45 * distance * std::sin(angle), 0.0);
    const double turn = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double size = random.uniform(0.02, 0.05);
    const Point x(size * std::cos(turn), size * std::sin(turn), 0.3 * size);
    const Point y(-size * std::sin(turn), size * std::cos(turn), 0.0);
    const Uv uv = random_uv(random, 9.0);
    builder.corners(at - x, at - 0.6 * y, at + x, at + 0.6 * y, foliage[random.below(2)], uv);
  }
}

void add_tuft(MeshBuilder& builder, Random& random, double radius_m, double height_m, int blades) {
  const std::uint32_t grass = builder.surface(Material::kGrass, random, {1.0F});
  for (int k = 0; k < blades; ++k) {
    const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double distance = radius_m * std::sqrt(random.uniform());
    const Point root(distance * std::cos(angle), distance * std::sin(angle), -0.05);
    const double lean = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double size = height_m * random.uniform(0.4, 1.0);
    const Point side(0.03 * std::sin(lean), -0.03 * std::cos(lean), 0.0);
    const Point tip = root + Point(0.4 * size * std::cos(lean), 0.4 * size * std::sin(lean), size);
    builder.triangle(root - side, root + side, tip, grass, random_uv(random, 9.0));
  }
}

}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/garden.hpp"

#include "world/steps.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::world {

void add_boundary(Maker& maker, MeshBuilder& builder, Random& random, const RigidTransform& frame,
                  double length_m) {
  if (length_m < 0.5) {
    return;
  }
  const int kind = random.below(4);
  const double height_m = random.uniform(0.8, 1.5);
  builder.set_frame(frame);
  if (kind == 0) {
    const int count = std::max(1, static_cast<int>(length_m / 1.9));
    for (int i = 0; i < count; ++i) {
      RigidTransform T = upright_at(frame * Point((i + 0.5) * length_m / count, 0.3, -0.05),
                                    std::atan2(frame.R(1, 0), frame.R(0, 0)));
      maker.put(maker.prototypes.hedge, T, random, 0.95, 1.05);
    }
  } else if (kind == 1) {  // boards
    const std::uint32_t wood = builder.surface(
        Material::kFence, random, {1.0F, static_cast<float>(random.uniform(0.15, 0.5))});
    for (const double x : steps(0.0, length_m - 0.1, 0.13)) {
      const double top = height_m + random.uniform(-0.015, 0.015);
      builder.box(Point(x, 0.1, -0.3), Point(x + 0.095, 0.122, top), wood);
    }
    builder.box(Point(0.0, 0.122, 0.3), Point(length_m, 0.16, 0.38), wood);
    builder.box(Point(0.0, 0.122, height_m - 0.3), Point(length_m, 0.16, height_m - 0.22), wood);
  } else if (kind == 2) {  // wall with a top
    const std::uint32_t wall = builder.surface(
        Material::kFacade, random,
        {random.chance(0.5) ? 1.0F : 4.0F, static_cast<float>(random.uniform(0.18, 0.5)), 3.0F});
    builder.box(Point(0.0, 0.05, -0.8), Point(length_m, 0.3, height_m - 0.08), wall);
    builder.box(Point(-0.03, 0.02, height_m - 0.08), Point(length_m + 0.03, 0.33, height_m), wall,
                true);
  } else {  // iron bars on a low wall
    const std::uint32_t wall = builder.surface(Material::kConcrete, random, {3.0F, 0.3F});
    const std::uint32_t iron =
        builder.surface(Material::kPole, random, {static_cast<float>(random.uniform(0.05, 0.2))});
    builder.box(Point(0.0, 0.05, -0.8), Point(length_m, 0.28, 0.4), wall);
    for (const double x : steps(0.1, length_m, 0.14)) {
      builder.bar(Point(x, 0.16, 0.4), Point(x, 0.16, height_m + 0.1), 0.011, 0.011, 3, iron);
    }
    for (const double z : {0.55, height_m}) {
      builder.box(Point(0.0, 0.145, z), Point(length_m, 0.175, z + 0.03), iron);
    }
  }
}

void plant_yard(Maker& maker, Random& random, const RigidTransform& frame, double width_m,
                double depth_m, int count) {
  for (int i = 0; i < count; ++i) {
    const double back = random.uniform(0.8, depth_m);
    const Point at = frame * Point(random.uniform(0.0, width_m), back, -0.1);
    if (!maker.site.is_free(at.head<2>())) {
      continue;
    }
    const bool tree = random.chance(0.35) && maker.site.nearest(at.head<2>()).distance_m > 9.5;
    const auto& meshes = tree ? maker.prototypes.trees : maker.prototypes.bushes;
    maker.put_any(meshes, at, random, 0.6, 1.0);
  }
}

}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/random.hpp"

#include "world/mesh_builder.hpp"

#include <cstdint>

/// Plants of many small faces turned all ways; they stand on z = 0.
namespace topoloc::world {

struct TreeForm {
  double height_m = 9.0;
  double radius_m = 3.0;
  double trunk_share = 0.3;  ///< of the height that is free of leaves
  double trunk_radius_m = 0.16;
  int blobs = 14;
  int leaves = 700;
  double leaf_m = 0.22;
  int sides = 7;  ///< of the trunk; 3: a tree for the distance, without branches
  bool conifer = false;
};

void add_leaf(MeshBuilder& builder, Random& random, const Point& middle, double size_m,
              std::uint32_t surface);
void add_tree(MeshBuilder& builder, Random& random, const TreeForm& form);
void add_bush(MeshBuilder& builder, Random& random, double radius_m, double height_m, int leaves);
/// Along x, about the origin.
void add_hedge(MeshBuilder& builder, Random& random, double length_m, double height_m);
/// Leaves on the ground, drifted along x.
void add_litter(MeshBuilder& builder, Random& random, double radius_m, int leaves);
void add_tuft(MeshBuilder& builder, Random& random, double radius_m, double height_m, int blades);

}  // namespace topoloc::world

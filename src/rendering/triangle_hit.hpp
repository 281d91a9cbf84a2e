// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/world.hpp"

#include <cstdint>

#include <Eigen/Core>

namespace topoloc::rendering {

/// A mesh put somewhere, with what takes rays to its own frame.
struct Placed {
  const world::Mesh* mesh = nullptr;
  std::uint32_t seed = 0;
  double scale = 1.0;
  RigidTransform T_world_mesh;
  RigidTransform T_mesh_world;
};

Placed placed(const world::World& world, const world::Instance& instance);

/// Where a line meets the plane of a triangle, in double precision: Embree finds the triangle, but
/// kilometres from the origin its single precision is good to a millimetre only.
struct PlaneHit {
  double distance_m = 0.0;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of the triangle, in the world
  Eigen::Vector2f uv_m = Eigen::Vector2f::Zero();
};

/// `embree_m`: what Embree says, kept where the line grazes the plane.
PlaneHit meet(const Placed& placed, std::uint32_t triangle, const Eigen::Vector3d& origin_m,
              const Eigen::Vector3d& direction, double embree_m);

/// How uv changes along the plane of a triangle, per metre in the world.
Eigen::Matrix<double, 2, 3> uv_per_metre(const Placed& placed, std::uint32_t triangle);

}  // namespace topoloc::rendering

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/triangle_hit.hpp"

#include <cmath>

namespace topoloc::rendering {

Placed placed(const world::World& world, const world::Instance& instance) {
  return {&world.meshes[instance.mesh], instance.seed, static_cast<double>(instance.scale),
          instance.T_world_mesh, instance.T_world_mesh.inverse()};
}

PlaneHit meet(const Placed& placed, std::uint32_t triangle, const Eigen::Vector3d& origin_m,
              const Eigen::Vector3d& direction, double embree_m) {
  const world::Mesh& mesh = *placed.mesh;
  const auto& corners = mesh.triangles[triangle].vertices;
  const world::Vertex& va = mesh.vertices[corners[0]];
  const world::Vertex& vb = mesh.vertices[corners[1]];
  const world::Vertex& vc = mesh.vertices[corners[2]];
  const Eigen::Vector3d a = va.position_m.cast<double>();
  const Eigen::Vector3d ab = vb.position_m.cast<double>() - a;
  const Eigen::Vector3d ac = vc.position_m.cast<double>() - a;
  const Eigen::Vector3d n = ab.cross(ac);
  const double n2 = n.squaredNorm();

  // Lengths along the ray are the world's: the mesh frame's divided by the scale.
  const Eigen::Vector3d o = (placed.T_mesh_world * origin_m) / placed.scale;
  const Eigen::Vector3d d = (placed.T_mesh_world.R * direction) / placed.scale;
  PlaneHit hit;
  hit.distance_m = embree_m;
  const double facing = n.dot(d);
  constexpr double kGrazing = 1e-4;
  if (facing * facing > kGrazing * kGrazing * n2 * d.squaredNorm()) {
    hit.distance_m = n.dot(a - o) / facing;
  }
  const Eigen::Vector3d ap = o + hit.distance_m * d - a;
  const auto u = static_cast<float>(ap.cross(ac).dot(n) / n2);
  const auto v = static_cast<float>(ab.cross(ap).dot(n) / n2);
  hit.uv_m = va.uv_m + u * (vb.uv_m - va.uv_m) + v * (vc.uv_m - va.uv_m);
  hit.normal = placed.T_world_mesh.R * (n / std::sqrt(n2));
  return hit;
}

Eigen::Matrix<double, 2, 3> uv_per_metre(const Placed& placed, std::uint32_t triangle) {
  const world::Mesh& mesh = *placed.mesh;
  const auto& corners = mesh.triangles[triangle].vertices;
  const world::Vertex& va = mesh.vertices[corners[0]];
  const world::Vertex& vb = mesh.vertices[corners[1]];
  const world::Vertex& vc = mesh.vertices[corners[2]];
  const Eigen::Vector3d ab = (vb.position_m - va.position_m).cast<double>();
  const Eigen::Vector3d ac = (vc.position_m - va.position_m).cast<double>();
  const Eigen::Vector3d n = ab.cross(ac);
  const double n2 = n.squaredNorm() * placed.scale;
  // Gradients of the barycentric coordinates of b and c.
  const Eigen::RowVector3d b = (placed.T_world_mesh.R * (ac.cross(n) / n2)).transpose();
  const Eigen::RowVector3d c = (placed.T_world_mesh.R * (n.cross(ab) / n2)).transpose();
  return (vb.uv_m - va.uv_m).cast<double>() * b + (vc.uv_m - va.uv_m).cast<double>() * c;
}

}  // namespace topoloc::rendering

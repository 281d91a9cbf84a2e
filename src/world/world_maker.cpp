// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/world_maker.hpp"

#include <cmath>

namespace topoloc::world {

Maker::Maker(World& made) : world(made), site(made.route, kBehind_m + 20.0, kBeyond_m + 40.0) {}

MeshBuilder Maker::prototype(std::uint32_t& index) {
  world.meshes.emplace_back();
  index = static_cast<std::uint32_t>(world.meshes.size() - 1);
  return {world.meshes.back(), world.surfaces};
}

bool Maker::open(double along_m, bool right, double margin_m) const {
  for (const SideStreet& street : side_streets) {
    if (street.right == right && std::abs(along_m - street.along_m) < kOpeningHalf_m + margin_m) {
      return false;
    }
  }
  return true;
}

double Maker::begin_m(const Section& section) const {
  return &section == &world.sections.front() ? first_m() : section.begin_m;
}

double Maker::end_m(const Section& section) const {
  return &section == &world.sections.back() ? last_m() : section.end_m;
}

RigidTransform upright_at(const Point& position, double heading_rad) {
  RigidTransform result;
  result.p = position;
  result.R = Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return result;
}

RigidTransform Maker::upright(double along_m, double left_m, double up_m) const {
  const RigidTransform T = world.route.T_world_road(along_m);
  return upright_at(T * Point(0.0, left_m, up_m), std::atan2(T.R(1, 0), T.R(0, 0)));
}

void Maker::put(std::uint32_t mesh, const RigidTransform& T_world_mesh, std::uint64_t seed,
                double scale) {
  world.instances.push_back({mesh, T_world_mesh, static_cast<float>(scale),
                             static_cast<std::uint32_t>(seed ^ (seed >> 32U))});
}

void Maker::put(std::uint32_t mesh, const RigidTransform& T_world_mesh, Random& random,
                double min_scale, double max_scale) {
  const double scale = random.uniform(min_scale, max_scale);
  put(mesh, T_world_mesh, random.next(), scale);
}

void Maker::put_any(std::span<const std::uint32_t> meshes, const Point& position, Random& random,
                    double min_scale, double max_scale) {
  const double scale = random.uniform(min_scale, max_scale);
  const std::uint64_t seed = random.next();
  const double heading = random.uniform(0.0, 6.28);
  const int mesh = random.below(static_cast<int>(meshes.size()));
  put(meshes[static_cast<std::size_t>(mesh)], upright_at(position, heading), seed, scale);
}

RigidTransform side_frame(const World& world, const SideStreet& street) {
  const double edge_m = profile_at(world.sections, street.along_m).edge(street.right);
  const double sign = street.right ? -1.0 : 1.0;
  const RigidTransform T = world.route.T_world_road(street.along_m);
  RigidTransform result;
  result.p = T * Point(0.0, sign * edge_m, 0.0);
  result.R.col(0) = (sign * T.R.col(1) + street.slope * T.R.col(2)).normalized();
  result.R.col(1) = -sign * T.R.col(0);
  result.R.col(2) = result.R.col(0).cross(Eigen::Vector3d(result.R.col(1)));
  return result;
}

}  // namespace topoloc::world

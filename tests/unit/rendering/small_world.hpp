// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/world/random.hpp"
#include "topoloc/world/world.hpp"

#include <array>
#include <cmath>
#include <cstdint>

#include <Eigen/Core>
#include <Eigen/Geometry>

/// Small worlds made by hand.
namespace topoloc::rendering::test {

inline std::uint32_t add_surface(world::World& world, world::Material material,
                                 std::uint32_t seed = 1) {
  std::array<float, 4> parameters{0.0F, 0.4F, 0.4F, 0.0F};  // kind, tone: see appearance.cpp
  if (material == world::Material::kAsphalt) {
    parameters = {0.3F, 0.0F, 0.0F, 0.12F};
  } else if (material == world::Material::kLamp) {
    parameters = {0.5F, 0.0F, 0.0F, 0.0F};
  }
  world.surfaces.push_back({material, seed, parameters});
  return static_cast<std::uint32_t>(world.surfaces.size() - 1);
}

/// Rectangle from `corner` along `u` and `v`, uv in metres from the corner.
inline void add_rectangle(world::Mesh& mesh, const Eigen::Vector3f& corner,
                          const Eigen::Vector3f& u, const Eigen::Vector3f& v,
                          std::uint32_t surface) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back({corner, {0.0F, 0.0F}});
  mesh.vertices.push_back({corner + u, {u.norm(), 0.0F}});
  mesh.vertices.push_back({corner + u + v, {u.norm(), v.norm()}});
  mesh.vertices.push_back({corner + v, {0.0F, v.norm()}});
  mesh.triangles.push_back({{first, first + 1, first + 2}, surface});
  mesh.triangles.push_back({{first, first + 2, first + 3}, surface});
}

inline void add_box(world::Mesh& mesh, const Eigen::Vector3f& least, const Eigen::Vector3f& most,
                    std::uint32_t surface) {
  const Eigen::Vector3f size = most - least;
  const Eigen::Vector3f x(size.x(), 0.0F, 0.0F);
  const Eigen::Vector3f y(0.0F, size.y(), 0.0F);
  const Eigen::Vector3f z(0.0F, 0.0F, size.z());
  add_rectangle(mesh, least, x, z, surface);
  add_rectangle(mesh, least + y, x, z, surface);
  add_rectangle(mesh, least, y, z, surface);
  add_rectangle(mesh, least + x, y, z, surface);
  add_rectangle(mesh, least, x, y, surface);
  add_rectangle(mesh, least + z, x, y, surface);
}

/// A road along x with houses on both sides, trees and parked cars (as instances).
inline world::World street() {
  using world::Material;
  world::World world;
  const std::uint32_t asphalt = add_surface(world, Material::kAsphalt);
  const std::uint32_t grass = add_surface(world, Material::kGrass);
  const std::uint32_t body = add_surface(world, Material::kCarBody);
  const std::uint32_t leaves = add_surface(world, Material::kFoliage);
  world.meshes.resize(3);
  world::Mesh& scenery = world.meshes[0];
  add_rectangle(scenery, {-50.0F, -6.0F, 0.0F}, {200.0F, 0.0F, 0.0F}, {0.0F, 12.0F, 0.0F}, asphalt);
  add_rectangle(scenery, {-50.0F, -60.0F, -0.1F}, {200.0F, 0.0F, 0.0F}, {0.0F, 120.0F, 0.0F},
                grass);
  for (std::uint32_t i = 0; i < 7; ++i) {
    const auto x = 18.0F * static_cast<float>(i);
    const std::uint32_t facade = add_surface(world, Material::kFacade, 10 + i);
    add_box(scenery, {x, 8.0F, 0.0F}, {x + 15.0F, 20.0F, 8.0F}, facade);
    add_box(scenery, {x + 5.0F, -20.0F, 0.0F}, {x + 19.0F, -8.0F, 11.0F}, facade);
  }
  add_box(world.meshes[1], {-1.0F, -0.9F, 0.2F}, {3.5F, 0.9F, 1.5F}, body);
  world.car_meshes = {1};
  world::Random random(3);
  const auto vector = [&](double size) {
    const double x = random.normal();
    const double y = random.normal();
    return (size * Eigen::Vector3d(x, y, random.normal())).cast<float>().eval();
  };
  for (int i = 0; i < 500; ++i) {
    add_rectangle(world.meshes[2], Eigen::Vector3f(0.0F, 0.0F, 5.0F) + vector(1.1), vector(0.15),
                  vector(0.15), leaves);
  }
  for (int i = 0; i < 9; ++i) {
    world::Instance tree;
    tree.mesh = 2;
    tree.scale = 1.0F + 0.1F * static_cast<float>(i % 3);
    tree.seed = static_cast<std::uint32_t>(i);
    tree.T_world_mesh.p = {14.0 * i, i % 2 == 0 ? 6.8 : -6.8, 0.0};
    world.instances.push_back(tree);
  }
  return world;
}

inline world::Instance car_at(double x_m, double y_m, double heading_rad = 0.0) {
  world::Instance car;
  car.mesh = 1;
  car.seed = 77;
  car.T_world_mesh.R = Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  car.T_world_mesh.p = {x_m, y_m, 0.0};
  return car;
}

/// A camera at a place that looks along the world's x.
inline RigidTransform looking_ahead(const Eigen::Vector3d& place_m) {
  RigidTransform T;
  T.R << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  T.p = place_m;
  return T;
}

inline CameraCalibration small_camera() {
  CameraCalibration calibration;
  calibration.pinhole = {160, 100, 112.5, 112.5, 79.5, 49.5};
  return calibration;
}

/// Share of white that a byte stands for: sRGB, undone.
inline double linear(double byte) {
  const double level = byte / 255.0;
  return level <= 0.04045 ? level / 12.92 : std::pow((level + 0.055) / 1.055, 2.4);
}

}  // namespace topoloc::rendering::test

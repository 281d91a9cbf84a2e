// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/world/random.hpp"
#include "topoloc/world/surface.hpp"

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace topoloc::world {

using Point = Eigen::Vector3d;
using Uv = Eigen::Vector2d;

/// Appends shapes, given in a frame of their own, to a mesh. Lengths in metres.
class MeshBuilder {
 public:
  MeshBuilder(Mesh& mesh, std::vector<Surface>& surfaces) : mesh_(&mesh), surfaces_(&surfaces) {}

  /// Frame of what follows. May mirror: the two sides of a street are alike.
  void set_frame(const RigidTransform& T_mesh_local) { frame_ = T_mesh_local; }
  [[nodiscard]] const RigidTransform& frame() const { return frame_; }

  std::uint32_t surface(Material material, std::uint32_t seed,
                        const std::array<float, 4>& parameters = {});
  /// With a look as it happens.
  std::uint32_t surface(Material material, Random& random,
                        const std::array<float, 4>& parameters = {}) {
    return surface(material, static_cast<std::uint32_t>(random.next()), parameters);
  }

  std::uint32_t vertex(const Point& p, const Uv& uv);
  void face(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t surface);
  void face(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d,
            std::uint32_t surface);

  /// Parallelogram; uv in metres along its sides, from `uv` at `origin`. Letters on it are to be
  /// read from the side that `along` x `up` points to in a right-handed frame; they are turned, so
  /// that they can be read in a mirrored one, too. No other shape does that.
  void quad(const Point& origin, const Point& along, const Point& up, std::uint32_t surface,
            const Uv& uv = Uv::Zero());
  /// Any four corners in turn; uv by the lengths of the sides at the first one.
  void corners(const Point& a, const Point& b, const Point& c, const Point& d,
               std::uint32_t surface, const Uv& uv = Uv::Zero());
  void triangle(const Point& a, const Point& b, const Point& c, std::uint32_t surface,
                const Uv& uv = Uv::Zero());
  /// Axis-parallel box without its bottom, which is rarely seen, unless asked for.
  void box(const Point& low, const Point& high, std::uint32_t surface, bool bottom = false);
  /// Round bar from one point to another, thinner or wider at the end; `caps` closes the end.
  void bar(const Point& from, const Point& to, double radius_from, double radius_to, int sides,
           std::uint32_t surface, bool caps = false);

 private:
  Mesh* mesh_;
  std::vector<Surface>* surfaces_;
  RigidTransform frame_;
};

}  // namespace topoloc::world

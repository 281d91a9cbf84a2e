// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/facet_of.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace topoloc::rendering {
namespace {

using Corners = std::array<std::uint32_t, 3>;

/// Place of the only corner of `a` that is not one of `b`.
std::optional<std::size_t> alone(const Corners& a, const Corners& b) {
  std::optional<std::size_t> result;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::find(b.begin(), b.end(), a[i]) == b.end()) {
      if (result) {
        return std::nullopt;
      }
      result = i;
    }
  }
  return result;
}

/// Whether the corners lie in one plane and turn one way.
bool flat_and_convex(const std::array<Eigen::Vector3d, 4>& corners, const Eigen::Vector3d& normal) {
  constexpr double kOff_m = 1e-3;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d to_next = corners[(i + 1) % 4] - corners[i];
    const Eigen::Vector3d onwards = corners[(i + 2) % 4] - corners[(i + 1) % 4];
    if (to_next.cross(onwards).dot(normal) <= 0.0 ||
        std::abs((corners[i] - corners[0]).dot(normal)) > kOff_m) {
      return false;
    }
  }
  return true;
}

Facet facet(const Placed& placed, std::uint32_t id, const Corners& corners) {
  Facet result;
  result.id = id;
  result.count = corners.size();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    result.corners[i] =
        placed.T_world_mesh *
        (placed.scale * placed.mesh->vertices[corners[i]].position_m.cast<double>());
  }
  const Eigen::Vector3d& from = result.corners[0];
  result.normal = (result.corners[1] - from).cross(result.corners[2] - from).normalized();
  return result;
}

/// A triangle and the next one, if they make a quadrangle.
std::optional<Facet> quadrangle(const Placed& placed, std::uint32_t triangle) {
  const auto& triangles = placed.mesh->triangles;
  if (triangle + 1 >= triangles.size()) {
    return std::nullopt;
  }
  const world::Triangle& a = triangles[triangle];
  const world::Triangle& b = triangles[triangle + 1];
  const auto of_a = alone(a.vertices, b.vertices);
  const auto of_b = alone(b.vertices, a.vertices);
  if (a.surface != b.surface || !of_a || !of_b ||
      a.vertices[(*of_a + 2) % 3] != b.vertices[(*of_b + 1) % 3]) {
    return std::nullopt;
  }
  const Corners first{a.vertices[*of_a], a.vertices[(*of_a + 1) % 3], a.vertices[(*of_a + 2) % 3]};
  const Corners second{first[0], first[1], b.vertices[*of_b]};
  Facet result = facet(placed, triangle, second);
  result.corners[3] = facet(placed, triangle, first).corners[2];
  result.count = 4;
  return flat_and_convex(result.corners, result.normal) ? std::optional(result) : std::nullopt;
}

}  // namespace

Facet facet_of(const Placed& placed, std::uint32_t triangle) {
  // The first of two takes the second, unless it is itself taken by the one before.
  const auto pair = [&](std::uint32_t first) -> std::optional<Facet> {
    auto result = quadrangle(placed, first);
    return result && first > 0 && quadrangle(placed, first - 1) ? std::nullopt : result;
  };
  if (auto with_next = pair(triangle)) {
    return *with_next;
  }
  if (triangle > 0) {
    if (auto with_previous = pair(triangle - 1)) {
      return *with_previous;
    }
  }
  return facet(placed, triangle, placed.mesh->triangles[triangle].vertices);
}

}  // namespace topoloc::rendering

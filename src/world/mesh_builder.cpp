// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/mesh_builder.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace topoloc::world {
namespace {

bool has_letters(Material material) {
  return material == Material::kSign || material == Material::kShopFront;
}

}  // namespace

std::uint32_t MeshBuilder::surface(Material material, std::uint32_t seed,
                                   const std::array<float, 4>& parameters) {
  surfaces_->push_back({material, seed, parameters});
  return static_cast<std::uint32_t>(surfaces_->size() - 1);
}

std::uint32_t MeshBuilder::vertex(const Point& p, const Uv& uv) {
  mesh_->vertices.push_back({(frame_ * p).cast<float>(), uv.cast<float>()});
  return static_cast<std::uint32_t>(mesh_->vertices.size() - 1);
}

void MeshBuilder::face(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t surface) {
  mesh_->triangles.push_back({{a, b, c}, surface});
}

void MeshBuilder::face(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d,
                       std::uint32_t surface) {
  face(a, b, c, surface);
  face(a, c, d, surface);
}

void MeshBuilder::quad(const Point& origin, const Point& along, const Point& up,
                       std::uint32_t surface, const Uv& uv) {
  const double length = along.norm();
  const double v = up.norm();
  // Letters run from left to right in a mirrored frame, too.
  const bool turned = has_letters((*surfaces_)[surface].material) && frame_.R.determinant() < 0.0;
  const double u0 = turned ? length : 0.0;
  const double u1 = length - u0;
  const std::uint32_t a = vertex(origin, uv + Uv(u0, 0.0));
  const std::uint32_t b = vertex(origin + along, uv + Uv(u1, 0.0));
  const std::uint32_t c = vertex(origin + along + up, uv + Uv(u1, v));
  const std::uint32_t d = vertex(origin + up, uv + Uv(u0, v));
  face(a, b, c, d, surface);
}

void MeshBuilder::corners(const Point& a, const Point& b, const Point& c, const Point& d,
                          std::uint32_t surface, const Uv& uv) {
  const double u = (b - a).norm();
  const double v = (d - a).norm();
  const std::uint32_t ia = vertex(a, uv);
  const std::uint32_t ib = vertex(b, uv + Uv(u, 0.0));
  const std::uint32_t ic = vertex(c, uv + Uv(u, v));
  const std::uint32_t id = vertex(d, uv + Uv(0.0, v));
  face(ia, ib, ic, id, surface);
}

void MeshBuilder::triangle(const Point& a, const Point& b, const Point& c, std::uint32_t surface,
                           const Uv& uv) {
  const Point ab = b - a;
  const double u = ab.norm();
  const double along = u > 0.0 ? (c - a).dot(ab) / u : 0.0;
  const double across = std::sqrt(std::max(0.0, (c - a).squaredNorm() - along * along));
  const std::uint32_t ia = vertex(a, uv);
  const std::uint32_t ib = vertex(b, uv + Uv(u, 0.0));
  const std::uint32_t ic = vertex(c, uv + Uv(along, across));
  face(ia, ib, ic, surface);
}

void MeshBuilder::box(const Point& low, const Point& high, std::uint32_t surface, bool bottom) {
  const Point size = high - low;
  const Point x(size.x(), 0.0, 0.0);
  const Point y(0.0, size.y(), 0.0);
  const Point z(0.0, 0.0, size.z());
  quad(low, x, z, surface);
  quad(low + y, x, z, surface, Uv(0.37, 0.0));
  quad(low, y, z, surface, Uv(size.x(), 0.0));
  quad(low + x, y, z, surface, Uv(size.x() + 0.19, 0.0));
  quad(low + z, x, y, surface, Uv(0.0, size.z()));
  if (bottom) {
    quad(low, x, y, surface, Uv(0.0, size.z() + 0.23));
  }
}

void MeshBuilder::bar(const Point& from, const Point& to, double radius_from, double radius_to,
                      int sides, std::uint32_t surface, bool caps) {
  const Point axis = to - from;
  const double length = axis.norm();
  const Point z = axis / length;
  const Point x = z.unitOrthogonal();
  const Point y = z.cross(x);
  const double radius = 0.5 * (radius_from + radius_to);
  std::vector<std::uint32_t> ring;
  for (int i = 0; i <= sides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / sides;
    const Point out = std::cos(angle) * x + std::sin(angle) * y;
    ring.push_back(vertex(from + radius_from * out, Uv(radius * angle, 0.0)));
    ring.push_back(vertex(to + radius_to * out, Uv(radius * angle, length)));
  }
  for (int i = 0; i < sides; ++i) {
    const std::size_t k = 2 * static_cast<std::size_t>(i);
    face(ring[k], ring[k + 2], ring[k + 3], ring[k + 1], surface);
  }
  if (caps) {
    const std::uint32_t middle = vertex(to, Uv(0.0, length + radius_to));
    for (int i = 0; i < sides; ++i) {
      const std::size_t k = 2 * static_cast<std::size_t>(i) + 1;
      face(ring[k], ring[k + 2], middle, surface);
    }
  }
}

}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/world.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include <Eigen/Core>

/// Offline: camera images and LiDAR scans of a world, by ray casting.
namespace topoloc::rendering {

struct Ray {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  ///< unit length
  double max_m = std::numeric_limits<double>::infinity();
};

/// Where a ray meets a surface.
struct Hit {
  double distance_m = 0.0;
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit length, towards the ray's origin
  Eigen::Vector2f uv_m = Eigen::Vector2f::Zero();
  const world::Surface* surface = nullptr;
  std::uint32_t instance = 0;  ///< world::Instance::seed
  bool moving = false;         ///< on a vehicle that drives
  std::uint32_t object = 0;    ///< 0: scenery, else 1 + number of the instance, parked, moving
  std::uint32_t triangle = 0;  ///< of the object's mesh
};

/// A flat piece of a surface: a triangle, or two that make a convex quadrangle.
struct Facet {
  std::array<Eigen::Vector3d, 4> corners;
  std::size_t count = 0;  ///< of corners
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  std::uint32_t id = 0;  ///< unlike those of the mesh's other facets
};

/// What stops a ray.
enum class Obstacles : std::uint8_t { kAll, kFixed, kMoving };

/// The world as rays see it (Embree). Casting is thread-safe, placing is not.
class Raycaster {
 public:
  /// `world` has to outlive it. `parked`: vehicles that stand for the whole drive. Throws
  /// std::invalid_argument if an instance names a mesh, or a triangle a vertex or a surface, that
  /// is not there.
  Raycaster(const world::World& world, std::span<const world::Instance> parked);
  ~Raycaster();
  Raycaster(Raycaster&&) noexcept;
  Raycaster& operator=(Raycaster&&) noexcept;

  /// Replaces the moving vehicles.
  void place_moving(std::span<const world::Instance> moving);

  [[nodiscard]] std::optional<Hit> cast(const Ray& ray,
                                        Obstacles obstacles = Obstacles::kAll) const;
  /// The same for many rays that start close together in much the same direction: sixteen at a
  /// time, several times faster.
  void cast(std::span<const Ray> rays, std::span<std::optional<Hit>> hits,
            Obstacles obstacles = Obstacles::kAll) const;
  /// Whether anything lies on the ray before its `max_m`.
  [[nodiscard]] bool blocked(const Ray& ray, Obstacles obstacles = Obstacles::kAll) const;
  /// The same for many rays; 1 where blocked.
  void blocked(std::span<const Ray> rays, std::span<std::uint8_t> results,
               Obstacles obstacles = Obstacles::kAll) const;
  /// The facet that was hit, in the world: the same for all hits on it, to the last bit.
  [[nodiscard]] Facet facet(const Hit& hit) const;
  /// How uv changes along the plane of the triangle that was hit, per metre in the world.
  [[nodiscard]] Eigen::Matrix<double, 2, 3> uv_per_metre(const Hit& hit) const;
  /// Where the object that was hit stands: the origin of its mesh, in the world.
  [[nodiscard]] const Eigen::Vector3d& place(const Hit& hit) const;
  /// Whether a moving vehicle stands within a distance.
  [[nodiscard]] bool near_moving(const Eigen::Vector3d& point_m, double within_m) const;
  [[nodiscard]] const world::World& world() const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

/// Where a ray may start that leaves a hit: off the surface by more than single precision errs.
Eigen::Vector3d off_surface(const Hit& hit);

}  // namespace topoloc::rendering

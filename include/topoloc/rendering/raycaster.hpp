// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/world.hpp"

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
};

/// The world as rays see it (Embree). Casting is thread-safe, placing is not.
class Raycaster {
 public:
  /// `world` has to outlive it. `parked`: vehicles that stand for the whole drive.
  Raycaster(const world::World& world, std::span<const world::Instance> parked);
  ~Raycaster();
  Raycaster(Raycaster&&) noexcept;
  Raycaster& operator=(Raycaster&&) noexcept;

  /// Replaces the moving vehicles.
  void place_moving(std::span<const world::Instance> moving);

  [[nodiscard]] std::optional<Hit> cast(const Ray& ray) const;
  /// Whether anything lies on the ray before its `max_m`.
  [[nodiscard]] bool blocked(const Ray& ray) const;
  [[nodiscard]] const world::World& world() const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace topoloc::rendering

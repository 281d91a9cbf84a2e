// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/raycaster.hpp"

#include "rendering/camera_path.hpp"
#include "rendering/lens.hpp"
#include "rendering/pixel_samples.hpp"

#include <span>

#include <Eigen/Core>

namespace topoloc::rendering {

/// What pixels are seen through and when.
struct Exposing {
  const Lens* lens = nullptr;
  const CameraPath* path = nullptr;
  PinholeCamera pinhole;
  double exposure_s = 0.0;
  double readout_s = 0.0;
  std::span<const PixelSample> samples;
};

/// How far off the middle of a pixel and of its exposure, in pixels and exposures.
struct Offset {
  double x = 0.0;
  double y = 0.0;
  double time = 0.0;
};

/// How a ray changes with its offset.
struct RayChange {
  Eigen::Vector3d direction_x;  ///< of the direction, per pixel
  Eigen::Vector3d direction_y;
  Eigen::Vector3d direction_time;  ///< per exposure
  Eigen::Vector3d origin_time_m;

  [[nodiscard]] Eigen::Vector3d direction(const Offset& offset) const {
    return offset.x * direction_x + offset.y * direction_y + offset.time * direction_time;
  }
  /// How far along the plane of a hit the point moves that a ray meets, to first order.
  [[nodiscard]] Eigen::Vector3d on_plane_m(const Hit& hit, const Eigen::Vector3d& sight,
                                           const Offset& offset) const {
    const Eigen::Vector3d aside_m =
        offset.time * origin_time_m + hit.distance_m * direction(offset);
    return aside_m - hit.normal.dot(aside_m) / hit.normal.dot(sight) * sight;
  }
};

/// Rays of the samples of pixels.
class Aim {
 public:
  explicit Aim(const Exposing& exposing) : exposing_(exposing) {}

  [[nodiscard]] std::size_t samples() const { return exposing_.samples.size(); }
  /// Angle that a pixel subtends.
  [[nodiscard]] double pixel_rad() const { return 1.0 / exposing_.pinhole.fx_px; }
  [[nodiscard]] Offset offset(int row, int column, std::size_t sample) const;
  /// Beyond the lens: `max_m` is 0.
  [[nodiscard]] Ray ray(int row, int column, const Offset& offset) const;
  /// About a pixel; not a number where the lens ends beside it.
  [[nodiscard]] RayChange change(int row, int column) const;

 private:
  [[nodiscard]] double row_s(int row) const;

  Exposing exposing_;
};

}  // namespace topoloc::rendering

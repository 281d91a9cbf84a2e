// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/mapping/cloud_grid.hpp"

#include <cstdint>
#include <limits>
#include <vector>

namespace topoloc::mapping {

/// How the cloud is projected (M1).
struct RenderConfig {
  double min_depth_m = 1.0;   ///< nearer points are on the vehicle, or noise
  double max_depth_m = 80.0;  ///< beyond, a pixel covers more than the cloud resolves
  /// Occlusion: a point covers a disc of this radius (twice as far as neighbours on a surface are
  /// apart), seen in pixels between the two limits.
  double footprint_m = 0.12;
  double min_footprint_px = 2.0;
  double max_footprint_px = 9.0;
  /// A point is behind another if it is deeper by depth_margin_m + depth_margin * depth: the
  /// thickness that one surface has in a cloud merged from many scans.
  double depth_margin_m = 0.15;
  double depth_margin = 0.02;
};

/// The cloud as one camera sees it; row-major images of the camera's size. At most one point a
/// pixel: the nearest, if nothing nearer surrounds it. Pixels without a point are holes.
struct RenderedView {
  static constexpr std::uint32_t kHole = std::numeric_limits<std::uint32_t>::max();

  PinholeCamera camera;
  std::vector<float> depth_m;             ///< Z along the optical axis; 0 in holes
  std::vector<float> intensity;           ///< in the cloud's units; 0 in holes
  std::vector<std::uint32_t> point;       ///< index into the grid's cloud; kHole in holes
  std::vector<Eigen::Vector2f> pixel_px;  ///< where in the pixel the point lies (not set in holes)

  [[nodiscard]] std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width_px) +
           static_cast<std::size_t>(u);
  }
  [[nodiscard]] bool is_hole(int u, int v) const { return point[index(u, v)] == kHole; }
  /// Share of pixels that show a point.
  [[nodiscard]] double coverage() const;
};

/// Projects the cloud into an undistorted camera at T_world_cam: z-buffered splatting with
/// occlusion handling (M1). Deterministic; may be called from many threads at once.
RenderedView render(const CloudGrid& grid, const PinholeCamera& camera,
                    const RigidTransform& T_world_cam, const RenderConfig& config = {});

/// Replaces the intensity of each visible point by the mean over all points of its surface in that
/// pixel: single returns of a spinning scanner speckle. `view` as render() gave it.
void average_intensity(const CloudGrid& grid, const RigidTransform& T_world_cam,
                       const RenderConfig& config, RenderedView& view);

}  // namespace topoloc::mapping

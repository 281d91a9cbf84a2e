// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/render.hpp"

#include "mapping/occlusion.hpp"

#include <algorithm>
#include <cstddef>

namespace topoloc::mapping {
namespace {

/// Calls visit(point index, pixel, depth) for every point of the cloud inside the image.
template <typename Visit>
void for_each_projected(const CloudGrid& grid, const PinholeCamera& camera,
                        const RigidTransform& T_world_cam, const RenderConfig& config,
                        const Visit& visit) {
  const SortedCloud& cloud = grid.cloud();
  const Eigen::Matrix3d R_cam_world = T_world_cam.R.transpose();
  const Eigen::Vector3d t_cam = R_cam_world * (cloud.origin_m - T_world_cam.p);
  for (const CloudGrid::Cell& cell : grid.cells_in_view(camera, T_world_cam, config.max_depth_m)) {
    for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
      const Eigen::Vector3d q_cam = R_cam_world * cloud.positions_m[i].cast<double>() + t_cam;
      if (q_cam.z() < config.min_depth_m || q_cam.z() > config.max_depth_m) {
        continue;
      }
      const Eigen::Vector2d pixel_px = camera.project(q_cam);
      if (camera.contains(pixel_px, -0.499)) {
        visit(i, pixel_px, q_cam.z());
      }
    }
  }
}

/// Index of the pixel that a point falls into. Not negative within the image, so that cutting off
/// is rounding down, and faster.
std::size_t pixel_index(const RenderedView& view, const Eigen::Vector2d& pixel_px) {
  return view.index(static_cast<int>(pixel_px.x() + 0.5), static_cast<int>(pixel_px.y() + 0.5));
}

/// Keeps the nearest point of every pixel (of equally near ones the first in the cloud).
void splat_nearest(const CloudGrid& grid, const RigidTransform& T_world_cam,
                   const RenderConfig& config, RenderedView& view) {
  for_each_projected(grid, view.camera, T_world_cam, config,
                     [&](std::uint32_t i, const Eigen::Vector2d& pixel_px, double z_m) {
                       const std::size_t at = pixel_index(view, pixel_px);
                       const auto depth_m = static_cast<float>(z_m);
                       if (view.point[at] == RenderedView::kHole || depth_m < view.depth_m[at]) {
                         view.depth_m[at] = depth_m;
                         view.intensity[at] = grid.cloud().intensities[i];
                         view.point[at] = i;
                         view.pixel_px[at] = pixel_px.cast<float>();
                       }
                     });
}

}  // namespace

double RenderedView::coverage() const {
  const auto holes = std::count(point.begin(), point.end(), kHole);
  return point.empty() ? 0.0 : 1.0 - static_cast<double>(holes) / static_cast<double>(point.size());
}

RenderedView render(const CloudGrid& grid, const PinholeCamera& camera,
                    const RigidTransform& T_world_cam, const RenderConfig& config) {
  const auto pixels =
      static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
  RenderedView view{camera, std::vector<float>(pixels, 0.0F), std::vector<float>(pixels, 0.0F),
                    std::vector<std::uint32_t>(pixels, RenderedView::kHole),
                    std::vector<Eigen::Vector2f>(pixels, Eigen::Vector2f::Zero())};
  splat_nearest(grid, T_world_cam, config, view);
  for (const std::size_t i : hidden_pixels(view, config)) {
    view.depth_m[i] = 0.0F;
    view.intensity[i] = 0.0F;
    view.point[i] = RenderedView::kHole;
  }
  return view;
}

void average_intensity(const CloudGrid& grid, const RigidTransform& T_world_cam,
                       const RenderConfig& config, RenderedView& view) {
  std::vector<float> count(view.intensity.size(), 0.0F);
  std::fill(view.intensity.begin(), view.intensity.end(), 0.0F);
  for_each_projected(
      grid, view.camera, T_world_cam, config,
      [&](std::uint32_t i, const Eigen::Vector2d& pixel_px, double z_m) {
        const std::size_t at = pixel_index(view, pixel_px);
        const auto surface_m = static_cast<double>(view.depth_m[at]);
        if (view.point[at] != RenderedView::kHole &&
            z_m <= surface_m + config.depth_margin_m + config.depth_margin * surface_m) {
          view.intensity[at] += grid.cloud().intensities[i];
          count[at] += 1.0F;
        }
      });
  for (std::size_t at = 0; at < count.size(); ++at) {
    view.intensity[at] /= std::max(1.0F, count[at]);
  }
}

}  // namespace topoloc::mapping

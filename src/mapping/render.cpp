// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/render.hpp"

#include "mapping/occlusion.hpp"

#include <algorithm>
#include <cstddef>

namespace topoloc::mapping {
namespace {

/// Keeps the nearest point of every pixel (of equally near ones the first in the cloud).
void splat_nearest(const CloudGrid& grid, const RigidTransform& T_world_cam,
                   const RenderConfig& config, RenderedView& view) {
  const SortedCloud& cloud = grid.cloud();
  const PinholeCamera& camera = view.camera;
  const Eigen::Matrix3d R_cam_world = T_world_cam.R.transpose();
  const Eigen::Vector3d t_cam = R_cam_world * (cloud.origin_m - T_world_cam.p);
  for (const CloudGrid::Cell& cell : grid.cells_in_view(camera, T_world_cam, config.max_depth_m)) {
    for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
      const Eigen::Vector3d q_cam = R_cam_world * cloud.positions_m[i].cast<double>() + t_cam;
      if (q_cam.z() < config.min_depth_m || q_cam.z() > config.max_depth_m) {
        continue;
      }
      const Eigen::Vector2d pixel_px = camera.project(q_cam);
      if (!camera.contains(pixel_px, -0.499)) {
        continue;
      }
      // Not negative within the image, so that cutting off is rounding down, and faster.
      const std::size_t at =
          view.index(static_cast<int>(pixel_px.x() + 0.5), static_cast<int>(pixel_px.y() + 0.5));
      const auto depth_m = static_cast<float>(q_cam.z());
      if (view.point[at] == RenderedView::kHole || depth_m < view.depth_m[at]) {
        view.depth_m[at] = depth_m;
        view.intensity[at] = cloud.intensities[i];
        view.point[at] = i;
        view.pixel_px[at] = pixel_px.cast<float>();
      }
    }
  }
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

}  // namespace topoloc::mapping

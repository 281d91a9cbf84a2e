// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/render.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

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
      const std::size_t at = view.index(static_cast<int>(std::floor(pixel_px.x() + 0.5)),
                                        static_cast<int>(std::floor(pixel_px.y() + 0.5)));
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

/// Pixel offsets of a disc, nearest first, with the sector (of eight, 45 degrees each) in which the
/// centre lies as seen from there.
struct DiscOffset {
  int du, dv;
  std::ptrdiff_t step;  ///< the same offset in a row-major image
  float squared_px;
  std::uint8_t sector_bit;
};

std::vector<DiscOffset> disc(double radius_px, int width_px) {
  std::vector<DiscOffset> offsets;
  const int reach = static_cast<int>(radius_px);
  for (int dv = -reach; dv <= reach; ++dv) {
    for (int du = -reach; du <= reach; ++du) {
      const int squared_px = du * du + dv * dv;
      if (squared_px == 0 || squared_px > radius_px * radius_px) {
        continue;
      }
      // Sectors are centred on the axes and diagonals.
      const double eighths = std::atan2(-dv, -du) * 4.0 / std::numbers::pi;
      const int sector = (static_cast<int>(std::lround(eighths)) + 8) % 8;
      offsets.push_back({du, dv, std::ptrdiff_t{dv} * width_px + du, static_cast<float>(squared_px),
                         static_cast<std::uint8_t>(1U << sector)});
    }
  }
  std::stable_sort(offsets.begin(), offsets.end(), [](const DiscOffset& a, const DiscOffset& b) {
    return a.squared_px < b.squared_px;
  });
  return offsets;
}

/// Longest run of clear bits on the circle of eight.
int largest_gap(std::uint8_t blocked) {
  if (blocked == 0) {
    return 8;
  }
  int largest = 0;
  for (int turn = 0; turn < 8; ++turn) {
    largest = std::max(largest, std::countr_zero(std::rotr(blocked, turn)));
  }
  return largest;
}

/// Pixels whose point is hidden: nearer points surround it. A plain larger splat would also hide
/// the ground behind the ground (its depth changes by 10 % within a few pixels) and whatever
/// stands beside an edge; nearer points on one side only hide nothing.
/// The idea of judging points by the free angle around them: R. Pintus, E. Gobbetti, M. Agus,
/// "Real-time rendering of massive unstructured raw point clouds using screen-space operators",
/// 2011.
///
/// Each point marks the pixels that it covers, so that the cost is the sum of the footprints: most
/// points are far away, and theirs are small.
std::vector<std::size_t> hidden_pixels(const RenderedView& view, const RenderConfig& config) {
  constexpr int kLargestGapOfHidden = 2;  // sectors: a right angle
  const PinholeCamera& camera = view.camera;
  // A point is behind another that is nearer than this; holes are behind nothing.
  std::vector<float> nearer_than_m(view.depth_m.size(), -std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < nearer_than_m.size(); ++i) {
    if (view.point[i] != RenderedView::kHole) {
      const double depth_m = view.depth_m[i];
      nearer_than_m[i] =
          static_cast<float>(depth_m - config.depth_margin_m - config.depth_margin * depth_m);
    }
  }
  // Sectors of each pixel in which something nearer covers it.
  std::vector<std::uint8_t> blocked(view.depth_m.size(), 0);
  const std::vector<DiscOffset> offsets = disc(config.max_footprint_px, camera.width_px);
  const int reach = static_cast<int>(config.max_footprint_px);
  const auto in_image = [&camera](int u, int v) {
    return u >= 0 && v >= 0 && u < camera.width_px && v < camera.height_px;
  };
  for (int v = 0; v < camera.height_px; ++v) {
    const bool rows_inside = v >= reach && v < camera.height_px - reach;
    for (int u = 0; u < camera.width_px; ++u) {
      if (view.is_hole(u, v)) {
        continue;
      }
      const std::size_t here = view.index(u, v);
      const float depth_m = view.depth_m[here];
      const double radius_px =
          std::clamp(camera.fx_px * config.footprint_m / static_cast<double>(depth_m),
                     config.min_footprint_px, config.max_footprint_px);
      const auto covers_px2 = static_cast<float>(radius_px * radius_px);
      const auto end = std::upper_bound(offsets.begin(), offsets.end(), covers_px2,
                                        [](float squared_px, const DiscOffset& offset) {
                                          return squared_px < offset.squared_px;
                                        });
      const bool inside = rows_inside && u >= reach && u < camera.width_px - reach;
      const float* const nearer_here_m = nearer_than_m.data() + here;
      std::uint8_t* const blocked_here = blocked.data() + here;
      const auto mark = [=](const DiscOffset& offset) {
        // Without a branch: whether a neighbour is behind is a coin toss for the processor.
        const auto behind = static_cast<unsigned>(depth_m < nearer_here_m[offset.step]);
        blocked_here[offset.step] |= static_cast<std::uint8_t>(offset.sector_bit & (0U - behind));
      };
      if (inside) {
        std::for_each(offsets.begin(), end, mark);
      } else {
        std::for_each(offsets.begin(), end, [&](const DiscOffset& offset) {
          if (in_image(u + offset.du, v + offset.dv)) {
            mark(offset);
          }
        });
      }
    }
  }
  std::vector<std::size_t> hidden;
  for (std::size_t i = 0; i < blocked.size(); ++i) {
    if (blocked[i] != 0 && largest_gap(blocked[i]) <= kLargestGapOfHidden) {
      hidden.push_back(i);
    }
  }
  return hidden;
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

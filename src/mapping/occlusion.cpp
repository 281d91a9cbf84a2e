// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/occlusion.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace topoloc::mapping {
namespace {

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

/// A point is behind another that is nearer than this [m]; holes are behind nothing.
std::vector<float> behind_what(const RenderedView& view, const RenderConfig& config) {
  std::vector<float> nearer_than_m(view.depth_m.size(), -std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < nearer_than_m.size(); ++i) {
    if (view.point[i] != RenderedView::kHole) {
      const double depth_m = view.depth_m[i];
      nearer_than_m[i] =
          static_cast<float>(depth_m - config.depth_margin_m - config.depth_margin * depth_m);
    }
  }
  return nearer_than_m;
}

/// Sectors of each pixel in which something nearer covers it. Each point marks the pixels that it
/// covers, so that the cost is the sum of the footprints: most points are far away, and theirs are
/// small.
std::vector<std::uint8_t> blocked_sectors(const RenderedView& view, const RenderConfig& config) {
  const PinholeCamera& camera = view.camera;
  const std::vector<float> nearer_than_m = behind_what(view, config);
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
  return blocked;
}

}  // namespace

std::vector<std::size_t> hidden_pixels(const RenderedView& view, const RenderConfig& config) {
  constexpr int kLargestGapOfHidden = 2;  // sectors: a right angle
  const std::vector<std::uint8_t> blocked = blocked_sectors(view, config);
  std::vector<std::size_t> hidden;
  for (std::size_t i = 0; i < blocked.size(); ++i) {
    if (blocked[i] != 0 && largest_gap(blocked[i]) <= kLargestGapOfHidden) {
      hidden.push_back(i);
    }
  }
  return hidden;
}

}  // namespace topoloc::mapping

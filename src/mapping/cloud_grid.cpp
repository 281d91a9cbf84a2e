// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/cloud_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <tuple>

namespace topoloc::mapping {
namespace {

using Key = std::tuple<std::int32_t, std::int32_t, std::int32_t>;

Key key_of(const CloudGrid::Cell& cell) { return {cell.x, cell.y, cell.z}; }

/// The four side planes of the camera's frustum: inward unit normals in camera axes, all through
/// the camera centre. Half a pixel wider than the pixel centres.
std::array<Eigen::Vector3d, 4> side_planes(const PinholeCamera& camera) {
  const Eigen::Vector3d top_left = camera.ray({-0.5, -0.5});
  const Eigen::Vector3d bottom_right = camera.ray({camera.width_px - 0.5, camera.height_px - 0.5});
  return {Eigen::Vector3d(1.0, 0.0, -top_left.x()).normalized(),
          Eigen::Vector3d(-1.0, 0.0, bottom_right.x()).normalized(),
          Eigen::Vector3d(0.0, 1.0, -top_left.y()).normalized(),
          Eigen::Vector3d(0.0, -1.0, bottom_right.y()).normalized()};
}

}  // namespace

CloudGrid::CloudGrid(PointCloud cloud, double cell_size_m)
    : cloud_(std::move(cloud)), cell_size_m_(cell_size_m) {
  if (cloud_.size() >= std::numeric_limits<std::uint32_t>::max()) {
    throw std::length_error("point cloud has more than 2^32 - 2 points: split it");
  }
  const auto count = static_cast<std::uint32_t>(cloud_.size());
  const auto cell_index = [&](float coordinate_m) {
    return static_cast<std::int32_t>(std::floor(coordinate_m / cell_size_m_));
  };
  struct Entry {
    Key key;
    std::uint32_t point;
    auto operator<=>(const Entry&) const = default;
  };
  std::vector<Entry> order(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const Eigen::Vector3f& p = cloud_.positions_m[i];
    order[i] = {{cell_index(p.x()), cell_index(p.y()), cell_index(p.z())}, i};
  }
  std::sort(order.begin(), order.end());

  std::vector<Eigen::Vector3f> positions_m(count);
  std::vector<float> intensities(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto& [key, point] = order[i];
    positions_m[i] = cloud_.positions_m[point];
    intensities[i] = cloud_.intensities[point];
    if (cells_.empty() || key_of(cells_.back()) != key) {
      cells_.push_back({std::get<0>(key), std::get<1>(key), std::get<2>(key), i, i});
    }
    cells_.back().end = i + 1;
  }
  cloud_.positions_m = std::move(positions_m);
  cloud_.intensities = std::move(intensities);
}

std::vector<CloudGrid::Cell> CloudGrid::cells_in_view(const PinholeCamera& camera,
                                                      const RigidTransform& T_world_cam,
                                                      double max_depth_m) const {
  const Eigen::Vector3d centre_m = T_world_cam.p - cloud_.origin_m;
  std::vector<Cell> seen;
  if (!(centre_m.lpNorm<Eigen::Infinity>() < 2.0 * kMaxExtent_m)) {
    return seen;  // also NaN
  }
  // Bounding box of the frustum: camera centre and the four corners at the largest depth.
  Eigen::AlignedBox3d box(centre_m);
  for (const double u_px : {-0.5, camera.width_px - 0.5}) {
    for (const double v_px : {-0.5, camera.height_px - 0.5}) {
      box.extend(centre_m + T_world_cam.R * (max_depth_m * camera.ray({u_px, v_px})));
    }
  }
  const Eigen::Vector3i first = (box.min() / cell_size_m_).array().floor().cast<int>();
  const Eigen::Vector3i last = (box.max() / cell_size_m_).array().floor().cast<int>();
  const auto planes = side_planes(camera);
  const double cell_radius_m = 0.5 * std::sqrt(3.0) * cell_size_m_;
  const auto in_frustum = [&](const Cell& cell) {
    const Eigen::Vector3d middle_m =
        cell_size_m_ * (Eigen::Vector3d(cell.x, cell.y, cell.z).array() + 0.5);
    const Eigen::Vector3d middle_cam = T_world_cam.R.transpose() * (middle_m - centre_m);
    return middle_cam.z() > -cell_radius_m && middle_cam.z() < max_depth_m + cell_radius_m &&
           std::all_of(planes.begin(), planes.end(), [&](const Eigen::Vector3d& normal) {
             return normal.dot(middle_cam) > -cell_radius_m;
           });
  };
  for (int x = first.x(); x <= last.x(); ++x) {
    for (int y = first.y(); y <= last.y(); ++y) {
      auto cell = std::lower_bound(
          cells_.begin(), cells_.end(), Key{x, y, first.z()},
          [](const Cell& candidate, const Key& key) { return key_of(candidate) < key; });
      for (; cell != cells_.end() && key_of(*cell) <= Key{x, y, last.z()}; ++cell) {
        if (in_frustum(*cell)) {
          seen.push_back(*cell);
        }
      }
    }
  }
  return seen;
}

}  // namespace topoloc::mapping

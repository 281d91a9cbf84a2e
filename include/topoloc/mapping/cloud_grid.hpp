// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/mapping/point_cloud.hpp"

#include <cstdint>
#include <vector>

namespace topoloc::mapping {

/// A point cloud sorted into cubic cells, so that one view costs what it sees, however large the
/// map is.
class CloudGrid {
 public:
  /// Points [begin, end) of cloud() lie in one cell.
  struct Cell {
    std::int32_t x, y, z;  ///< floor(position / cell size), relative to the cloud's origin
    std::uint32_t begin, end;
  };

  /// Takes the cloud and reorders its points cell by cell (stable: the same cloud gives the same
  /// order). At most 2^32 - 2 points (std::length_error).
  explicit CloudGrid(PointCloud cloud, double cell_size_m = 8.0);

  [[nodiscard]] const PointCloud& cloud() const { return cloud_; }
  [[nodiscard]] const std::vector<Cell>& cells() const { return cells_; }

  /// Cells that may hold a point with 0 < Z < max_depth_m inside the image; in fixed order.
  [[nodiscard]] std::vector<Cell> cells_in_view(const PinholeCamera& camera,
                                                const RigidTransform& T_world_cam,
                                                double max_depth_m) const;

 private:
  PointCloud cloud_;
  double cell_size_m_;
  std::vector<Cell> cells_;  // sorted by x, y, z
};

}  // namespace topoloc::mapping

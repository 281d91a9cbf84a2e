// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/mapping/cloud_grid.hpp"

#include <cstddef>
#include <span>
#include <string>

#include <Eigen/Geometry>

namespace topoloc::mapping {

/// Which poses of a drive have any of the cloud in their camera's sight.
struct CloudCover {
  std::size_t poses = 0;
  std::size_t blind = 0;            ///< of them, with nothing in sight
  Eigen::AlignedBox3d cloud_world;  ///< [m] around all points
  Eigen::AlignedBox3d drive_world;  ///< [m] around all poses

  /// Most poses see nothing: another place, or another frame.
  [[nodiscard]] bool lies_elsewhere() const { return 2 * blind > poses; }
  /// With the figures, and what to check.
  [[nodiscard]] std::string complaint() const;
};

/// Cell by cell (CloudGrid): quick, and before any image is looked at.
CloudCover cloud_cover(const CloudGrid& grid, const PinholeCamera& camera,
                       const RigidTransform& T_imu_cam, std::span<const RigidTransform> T_world_imu,
                       double max_depth_m);

}  // namespace topoloc::mapping

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/mapping/cloud_grid.hpp"

#include <span>

namespace topoloc::refinement {

/// Throws std::runtime_error, with what to check, where no image need be looked at to tell that a
/// cloud is of no use: without intensities, or nowhere near the poses to start from.
void check_cloud(const mapping::CloudGrid& grid, const PinholeCamera& camera,
                 const RigidTransform& T_imu_cam, std::span<const RigidTransform> T_world_imu,
                 double max_depth_m);

}  // namespace topoloc::refinement

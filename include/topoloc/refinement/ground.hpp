// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/cloud_grid.hpp"

#include <optional>

#include <Eigen/Core>

namespace topoloc::refinement {

/// The road where a vehicle stands: z = height_m + slope . (xy - place).
struct Ground {
  Eigen::Vector2d place;  ///< x, y in the world [m]
  double height_m;        ///< z there
  Eigen::Vector2d slope;
};

/// The ground in the cloud below a point of the vehicle; nothing where there are too few points, or
/// they are no plane. The map was made by driving there: mostly there is a road.
std::optional<Ground> ground_below(const mapping::CloudGrid& grid, const Eigen::Vector3d& p_world);

}  // namespace topoloc::refinement

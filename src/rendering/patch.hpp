// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/raycaster.hpp"

#include <span>

#include <Eigen/Core>

namespace topoloc::rendering {

/// Samples of one pixel that fell on one surface, and the light there.
struct Patch {
  Hit hit;                                               ///< of one of them
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  ///< of its ray, unit length
  std::span<const Eigen::Vector2f> uvs_m;
  float sunlit = 0.0F;      ///< share of the samples that the sun shines on
  double pixel_rad = 0.0;   ///< angle that a pixel subtends
  float around = 0.0F;      ///< irradiance from all sides
  float lamps = 0.0F;       ///< irradiance by street lamps and the like
  float head_lamps = 0.0F;  ///< by the vehicle's own
  float beam = 0.0F;        ///< of these at right angles to their light
};

}  // namespace topoloc::rendering

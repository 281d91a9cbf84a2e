// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/surface.hpp"

namespace topoloc::world {

/// Bounds of a vehicle about the middle of its rear axle.
struct VehicleSize {
  double rear_m = 0.0;  ///< negative
  double front_m = 0.0;
  double half_width_m = 0.0;
};
VehicleSize size_of(const Mesh& mesh);

}  // namespace topoloc::world

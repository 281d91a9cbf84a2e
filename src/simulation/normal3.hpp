// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/random.hpp"

#include <Eigen/Core>

namespace topoloc::simulation {

/// Standard deviation 1 per axis; drawn in the order x, y, z, whatever the compiler.
inline Eigen::Vector3d normal3(world::Random& random) {
  const double x = random.normal();
  const double y = random.normal();
  const double z = random.normal();
  return {x, y, z};
}

}  // namespace topoloc::simulation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "world/world_maker.hpp"

namespace topoloc::world {

/// What stands at the footway before and between houses: fence, wall or hedge along x.
void add_boundary(Maker& maker, MeshBuilder& builder, Random& random, const RigidTransform& frame,
                  double length_m);

/// Trees and bushes in a yard.
void plant_yard(Maker& maker, Random& random, const RigidTransform& frame, double width_m,
                double depth_m, int count);

}  // namespace topoloc::world

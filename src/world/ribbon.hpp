// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "world/mesh_builder.hpp"

#include <cstdint>
#include <functional>
#include <vector>

namespace topoloc::world {

/// A place across a road's frame.
struct Across {
  double left_m = 0.0;
  double up_m = 0.0;
};

/// Something that roads follow: the route, or a side street.
using Frames = std::function<RigidTransform(double along_m)>;
/// Cross-section of a ribbon; as many points at every place.
using CrossSection = std::function<std::vector<Across>(double along_m)>;

/// Places from begin to end: both, and all multiples of `step_m` between.
std::vector<double> stations(double begin_m, double end_m, double step_m);

/// Surface swept along a road. uv: way along; way across from the first point, which has `left_m`
/// where `from_line` is set (patterns then know the lanes), else 0.
void ribbon(MeshBuilder& builder, const Frames& frames, const std::vector<double>& along_m,
            const CrossSection& across, std::uint32_t surface, bool from_line = false);

}  // namespace topoloc::world

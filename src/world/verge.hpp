// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "world/world_maker.hpp"

namespace topoloc::world {

/// Whether a place lies open, without footways: grass begins at the road's edge.
bool open_country(const Maker& maker, double along_m);
/// Height of the land beside the road, `out_m` from its edge.
double verge_m(const Maker& maker, double along_m, bool right, double out_m);
constexpr double kVerge_m = 42.0;  ///< how far it reaches

/// Grass beside the road, what grows on it, the median between the directions.
void make_verge(Maker& maker, double begin_m, double end_m);

/// Rails, posts, noise barriers.
void make_barriers(Maker& maker, double begin_m, double end_m);
/// Gantries, boards, bridges over the road, lamps.
void make_overhead(Maker& maker, const Section& section, double begin_m, double end_m);

}  // namespace topoloc::world

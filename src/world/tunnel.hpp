// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "world/world_maker.hpp"

namespace topoloc::world {

/// The inside of a tunnel across: a box with sloping shoulders, walls `right` and `left` of the
/// route's line.
struct Bore {
  double right_m = 0.0;  ///< of the right wall; negative
  double left_m = 0.0;
  double wall_m = 3.9;  ///< where walls end and the vault begins
  double roof_m = 5.6;
};
Bore bore_at(const Maker& maker, double along_m);

/// Lamps, fans, niches, signs, cables: all that repeats, and the little that does not.
void make_tunnel_things(Maker& maker, const Section& section);
/// Portals and the hill above.
void make_portals(Maker& maker, const Section& section);

}  // namespace topoloc::world

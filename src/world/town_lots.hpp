// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "world/world_maker.hpp"

namespace topoloc::world {

/// Houses, their yards and what parts them, along the road and its side streets.
void make_town_lots(Maker& maker, const Section& section);
/// Lamps, trees, signs, bins and the like on footways.
void make_footway_things(Maker& maker, const Section& section);

}  // namespace topoloc::world

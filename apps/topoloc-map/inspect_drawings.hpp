// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "map_quality.hpp"

#include <filesystem>

namespace topoloc::apps {

/// One PNG a node, node_NNNNNN.png: every `every`-th node, or about ten of them, evenly spaced, if
/// that is 0. Throws std::runtime_error that names the map and what it lacks if it has no images.
void write_overlays(const std::filesystem::path& folder, const map::MapFile& map,
                    const MapQuality& quality, int every);

/// map.png (from above) and figures.png (along the way). Draws what there is: a stripped map has
/// no cloud, one without report no rejected nodes.
void write_plots(const std::filesystem::path& folder, const map::MapFile& map,
                 const MapQuality& quality);

}  // namespace topoloc::apps

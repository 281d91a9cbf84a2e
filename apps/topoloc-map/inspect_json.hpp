// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "map_quality.hpp"

#include <string>

namespace topoloc::apps {

/// All that `inspect` knows of a map, as JSON text: figures, sections, build report, every node.
std::string inspect_json(const map::MapFile& map, const map::MapSummary& summary,
                         const MapQuality& quality);

}  // namespace topoloc::apps

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "map_quality.hpp"

namespace topoloc::apps {

/// Prints on stdout what a map holds and how good its nodes are.
void print_inspection(const map::MapFile& map, const map::MapSummary& summary,
                      const MapQuality& quality);

}  // namespace topoloc::apps

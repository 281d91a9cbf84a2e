// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "map_quality.hpp"

#include <opencv2/core.hpp>

namespace topoloc::apps {

/// All figures of the nodes along the way, one chart below the other; rejected nodes as crosses at
/// their value, or in the strip below where they have none.
cv::Mat draw_figures(const map::MapFile& map, const MapQuality& quality);

}  // namespace topoloc::apps

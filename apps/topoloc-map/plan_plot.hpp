// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "map_quality.hpp"

#include <opencv2/core.hpp>

namespace topoloc::apps {

/// The map from above, x to the right and y up: the cloud as its nodes see it (intensity; depth
/// alone where there is none), accepted nodes coloured by the standard deviation of their position,
/// rejected ones as crosses, gaps as red lines.
cv::Mat draw_plan(const map::MapFile& map, const MapQuality& quality);

}  // namespace topoloc::apps

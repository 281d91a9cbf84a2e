// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/map_file.hpp"

#include <opencv2/core.hpp>

namespace topoloc::apps {

/// The images of a node, decoded; empty where the map has none.
struct NodeImages {
  cv::Mat grey;       ///< CV_8UC1
  cv::Mat depth_m;    ///< CV_32FC1, 0: no point
  cv::Mat intensity;  ///< CV_8UC1, 0: no point
};

/// Throws map::MapError that names map and node on images that cannot be decoded or are not of the
/// camera's size.
NodeImages decode_images(const map::MapFile& map, std::size_t node);

/// Holes of up to `reach_px` pixels around points filled with the mean of their neighbours, so that
/// surfaces look closed; CV_32FC1, 0 stays "nothing". `image` CV_8UC1 or CV_32FC1.
cv::Mat fill_small_holes(const cv::Mat& image, int reach_px);

}  // namespace topoloc::apps

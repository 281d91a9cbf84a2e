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

/// With holes of a few pixels between points closed, so that surfaces are; CV_32FC1, 0: nothing.
cv::Mat fill_intensity(const cv::Mat& intensity);
cv::Mat fill_depth(const cv::Mat& depth_m);

}  // namespace topoloc::apps

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "node_images.hpp"

#include <string>

#include <opencv2/core.hpp>

namespace topoloc::apps {

/// Camera image and LiDAR of a node in four panels: the two side by side, the LiDAR's intensity in
/// colour over the camera image, and its edges over the camera image. Where the node's pose is
/// right, wall edges, poles and lane markings coincide. Needs all three images.
cv::Mat draw_overlay(const NodeImages& images, const std::string& title);

}  // namespace topoloc::apps

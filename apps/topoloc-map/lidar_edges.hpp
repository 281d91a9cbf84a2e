// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <opencv2/core.hpp>

namespace topoloc::apps {

/// Lines one pixel wide (255, else 0) where the intensity steps: lane markings, signs, kerbs. From
/// an image with its small holes filled (CV_8UC1, 1 to 255, 0: nothing), in which people see what
/// there is to see; nothing at the rims of what is known.
cv::Mat intensity_edges(const cv::Mat& stretched);

/// Pixels (255, else 0) of a surface that ends in front of a farther one: poles, corners, cars.
/// `filled_m`: depth [m] with small holes filled, CV_32FC1, 0: nothing.
cv::Mat depth_edges(const cv::Mat& filled_m);

}  // namespace topoloc::apps

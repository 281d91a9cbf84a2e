// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/transport/image_view.hpp"

#include <opencv2/core.hpp>

namespace topoloc::drive {

/// Decodes a checked message (transport::view_image) into CV_8UC1 of its own memory. False, and
/// `grey` empty, where JPEG data does not decode to `size`; a GRAY image must have that size.
bool decode_grey(const transport::ImageView& image, cv::Size size, cv::Mat& grey);

}  // namespace topoloc::drive

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/render.hpp"

#include <opencv2/core.hpp>

namespace topoloc::refinement {

/// Intensities of a rendered view without its speckle and its gaps between scan lines.
struct SmoothIntensity {
  cv::Mat root;  ///< CV_32FC1: root of the mean over the points around, in units of the view
  cv::Mat seen;  ///< CV_32FC1: 1 where a pixel shows a point, else 0
};

/// Mean of the points around each pixel, however many they are (normalised convolution).
SmoothIntensity smooth_intensity(const mapping::RenderedView& view, double sigma_px);

}  // namespace topoloc::refinement

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/render.hpp"

#include <opencv2/core.hpp>

namespace topoloc::refinement {

/// How gradients are taken from the camera image and the rendered intensity.
struct GradientConfig {
  double camera_sigma_px = 2.0;     ///< smoothing of the camera image
  double intensity_sigma_px = 2.0;  ///< smoothing of the intensities, over the holes
  double contrast_sigma_px = 12.0;  ///< neighbourhood that a gradient has to stand out from
  double min_cloud_density = 0.08;  ///< share of pixels that must show a point around a pixel
};

/// Orientation of the brightness gradient in double angles: CV_32FC2 (cos 2a, sin 2a), times a
/// weight from 0 to 1 that says how far the gradient stands out of its neighbourhood.
///
/// The double angle forgets the sign: LiDAR intensity and camera brightness agree in where the
/// edges are, not in which side of them is bright. Zero where nothing is known.
struct GradientField {
  cv::Mat orientation;  ///< CV_32FC2
  cv::Mat valid;        ///< CV_8UC1, 255 where the field is known
};

/// Of a camera image (CV_8UC1); pixels that are 0 in `mask` (CV_8UC1) are unknown.
GradientField camera_gradients(const cv::Mat& grey, const cv::Mat& mask,
                               const GradientConfig& config);

/// Of the intensities of a rendered cloud. Their unit does not matter.
GradientField intensity_gradients(const mapping::RenderedView& view, const GradientConfig& config);

}  // namespace topoloc::refinement

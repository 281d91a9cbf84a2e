// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/smooth_intensity.hpp"

#include <algorithm>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace topoloc::refinement {
namespace {

/// Intensity that 95 of 100 visible points do not reach: makes any unit comparable.
float bright(const mapping::RenderedView& view) {
  std::vector<float> values;
  for (std::size_t i = 0; i < view.intensity.size(); ++i) {
    if (view.point[i] != mapping::RenderedView::kHole) {
      values.push_back(view.intensity[i]);
    }
  }
  if (values.empty()) {
    return 0.0F;
  }
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 95 / 100);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

SmoothIntensity smooth_intensity(const mapping::RenderedView& view, double sigma_px) {
  const cv::Size size(view.camera.width_px, view.camera.height_px);
  const float scale = bright(view);
  cv::Mat seen = cv::Mat::zeros(size, CV_32F);
  cv::Mat sum = cv::Mat::zeros(size, CV_32F);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      if (!view.is_hole(u, v)) {
        seen.at<float>(v, u) = 1.0F;
        sum.at<float>(v, u) =
            scale > 0.0F ? std::clamp(view.intensity[view.index(u, v)] / scale, 0.0F, 2.0F) : 0.0F;
      }
    }
  }
  cv::Mat density;
  cv::GaussianBlur(seen, density, cv::Size(), sigma_px);
  cv::GaussianBlur(sum, sum, cv::Size(), sigma_px);
  cv::Mat root = sum / (density + 1e-6F);
  // The root evens out retro-reflectors and tarmac.
  cv::sqrt(cv::max(root, 0.0), root);
  return {root, seen};
}

}  // namespace topoloc::refinement

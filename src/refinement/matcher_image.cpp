// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/matcher_image.hpp"

#include "topoloc/evaluation/median.hpp"

#include "refinement/smooth_intensity.hpp"

#include <vector>

#include <opencv2/imgproc.hpp>

namespace topoloc::refinement {

matching::MaskedImage matcher_image(const mapping::RenderedView& view) {
  constexpr double kSmoothing_px = 1.2;
  constexpr double kNeighbourhood_px = 2.0;
  constexpr double kMinDensity = 0.12;  // share of pixels around that show a point
  constexpr double kClipped = 0.02;
  constexpr double kUnknown_grey = 128.0;
  const auto [root, seen] = smooth_intensity(view, kSmoothing_px);
  cv::Mat density;
  cv::GaussianBlur(seen, density, cv::Size(), kNeighbourhood_px);
  matching::MaskedImage result{{}, density > kMinDensity};
  std::vector<float> known;
  for (int v = 0; v < root.rows; ++v) {
    for (int u = 0; u < root.cols; ++u) {
      if (result.mask.at<unsigned char>(v, u) != 0) {
        known.push_back(root.at<float>(v, u));
      }
    }
  }
  const double dark = evaluation::quantile(known, kClipped);
  const double bright = evaluation::quantile(known, 1.0 - kClipped);
  const double scale = bright > dark ? 255.0 / (bright - dark) : 0.0;
  root.convertTo(result.grey, CV_8U, scale, -scale * dark);  // saturates
  result.grey.setTo(kUnknown_grey, result.mask == 0);
  return result;
}

}  // namespace topoloc::refinement

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "matching/pixel_matches.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::matching {
namespace {

bool usable(const MaskedImage& image, const Eigen::Vector2f& pixel_px) {
  // In float: a wild value must not overflow an int. Comparisons that NaN fails.
  const float x = std::round(pixel_px.x());
  const float y = std::round(pixel_px.y());
  if (!(x >= 0.0F && x < static_cast<float>(image.grey.cols) && y >= 0.0F &&
        y < static_cast<float>(image.grey.rows))) {
    return false;
  }
  return image.mask.empty() ||
         image.mask.at<std::uint8_t>(static_cast<int>(y), static_cast<int>(x)) != 0;
}

}  // namespace

void remove_unusable(const MaskedImage& image0, const MaskedImage& image1,
                     std::vector<PixelMatch>& matches) {
  std::erase_if(matches, [&](const PixelMatch& match) {
    return !usable(image0, match.pixel0_px) || !usable(image1, match.pixel1_px) ||
           !std::isfinite(match.confidence);
  });
}

void sort_by_confidence(std::vector<PixelMatch>& matches) {
  std::stable_sort(matches.begin(), matches.end(), [](const PixelMatch& a, const PixelMatch& b) {
    return a.confidence > b.confidence;
  });
}

}  // namespace topoloc::matching

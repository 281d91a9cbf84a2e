// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/matching/image_pair_matcher.hpp"

#include "unit/refinement/textured_street.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace topoloc::refinement {

/// A matcher without a network for images of a TexturedStreet: corners of the first looked for
/// nearby in the second by normalised correlation, whichever of both is the negative.
class TemplateMatcher : public matching::ImagePairMatcher {
 public:
  [[nodiscard]] cv::Size input_size() const override {
    return {TexturedStreet::camera().width_px, TexturedStreet::camera().height_px};
  }
  void match(const matching::MaskedImage& image0, const matching::MaskedImage& image1,
             std::vector<matching::PixelMatch>& out) override {
    constexpr int kPatch_px = 12;
    constexpr int kReach_px = 30;
    constexpr int kBorder_px = kPatch_px + kReach_px;
    constexpr double kAlike = 0.6;
    out.clear();
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(image0.grey, corners, 150, 0.02, 10.0, image0.mask);
    const cv::Rect inside(kBorder_px, kBorder_px, image0.grey.cols - 2 * kBorder_px,
                          image0.grey.rows - 2 * kBorder_px);
    for (const cv::Point2f& corner : corners) {
      const cv::Point at = corner;
      if (!inside.contains(at)) {
        continue;
      }
      const auto around = [&](int radius) {
        return cv::Rect(at.x - radius, at.y - radius, 2 * radius + 1, 2 * radius + 1);
      };
      cv::Mat alike;
      cv::matchTemplate(image1.grey(around(kBorder_px)), image0.grey(around(kPatch_px)), alike,
                        cv::TM_CCOEFF_NORMED);
      double best = 0.0;
      cv::Point where;
      cv::minMaxLoc(cv::abs(alike), nullptr, &best, nullptr, &where);
      if (best > kAlike) {
        const Eigen::Vector2f pixel_px(static_cast<float>(at.x), static_cast<float>(at.y));
        const Eigen::Vector2f shift_px(static_cast<float>(where.x - kReach_px),
                                       static_cast<float>(where.y - kReach_px));
        out.push_back({pixel_px, pixel_px + shift_px, static_cast<float>(best)});
      }
    }
    std::stable_sort(out.begin(), out.end(),
                     [](const auto& a, const auto& b) { return a.confidence > b.confidence; });
  }
};

/// A matcher that never finds a match.
class BlindMatcher : public TemplateMatcher {
 public:
  void match(const matching::MaskedImage& /*image0*/, const matching::MaskedImage& /*image1*/,
             std::vector<matching::PixelMatch>& out) override {
    out.clear();
  }
};

}  // namespace topoloc::refinement

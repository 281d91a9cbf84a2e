// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/matching/features.hpp"
#include "topoloc/matching/image_pair_matcher.hpp"

namespace topoloc::matching {

/// Matches two images by their features.
class FeaturePairMatcher final : public ImagePairMatcher {
 public:
  FeaturePairMatcher(std::unique_ptr<FeatureExtractor> extractor,
                     std::unique_ptr<FeatureMatcher> matcher);

  [[nodiscard]] cv::Size input_size() const override { return extractor_->input_size(); }
  void match(const MaskedImage& image0, const MaskedImage& image1,
             std::vector<PixelMatch>& out) override;

 private:
  void extract(const MaskedImage& image, FeatureSet& out);

  std::unique_ptr<FeatureExtractor> extractor_;
  std::unique_ptr<FeatureMatcher> matcher_;
  cv::Mat everywhere_;  ///< the mask of an image that has none
  // Of the current pair; members for their memory.
  FeatureSet features0_;
  FeatureSet features1_;
  std::vector<FeatureMatch> matches_;
};

}  // namespace topoloc::matching

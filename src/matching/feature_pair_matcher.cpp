// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "matching/feature_pair_matcher.hpp"

#include "matching/pixel_matches.hpp"

#include <utility>

namespace topoloc::matching {

FeaturePairMatcher::FeaturePairMatcher(std::unique_ptr<FeatureExtractor> extractor,
                                       std::unique_ptr<FeatureMatcher> matcher)
    : extractor_(std::move(extractor)),
      matcher_(std::move(matcher)),
      everywhere_(extractor_->input_size(), CV_8UC1, cv::Scalar(255)) {}

void FeaturePairMatcher::extract(const MaskedImage& image, FeatureSet& out) {
  extractor_->set_mask(image.mask.empty() ? everywhere_ : image.mask);
  extractor_->extract(image.grey, out);
}

void FeaturePairMatcher::match(const MaskedImage& image0, const MaskedImage& image1,
                               std::vector<PixelMatch>& out) {
  out.clear();
  extract(image0, features0_);
  extract(image1, features1_);
  matcher_->match(features0_, features1_, matches_);
  for (const FeatureMatch& match : matches_) {
    out.push_back({.pixel0_px = features0_.pixels_px[static_cast<std::size_t>(match.query)],
                   .pixel1_px = features1_.pixels_px[static_cast<std::size_t>(match.node)],
                   .confidence = match.score});
  }
  // A keypoint refined to sub-pixel may have stepped onto a masked neighbour.
  remove_unusable(image0, image1, out);
  sort_by_confidence(out);
}

}  // namespace topoloc::matching

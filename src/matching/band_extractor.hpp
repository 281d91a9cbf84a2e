// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/matching/config.hpp"
#include "topoloc/matching/features.hpp"

#include <memory>

namespace topoloc::matching {

/// Features of the middle half of the image's rows, in pixels of the whole image: half the work,
/// where roadsides and facades are. (Images of half the size would be a quarter, but XFeat's
/// descriptors do not match over that difference in scale.)
class BandExtractor final : public FeatureExtractor {
 public:
  /// `band`: takes images as wide as the whole one and about half as high.
  BandExtractor(std::unique_ptr<FeatureExtractor> band, cv::Size whole_size);

  [[nodiscard]] const map::ModelIdentity& identity() const override { return band_->identity(); }
  [[nodiscard]] int max_features() const override { return band_->max_features(); }
  [[nodiscard]] cv::Size input_size() const override { return whole_size_; }
  void set_mask(const cv::Mat& mask) override;
  void extract(const cv::Mat& undistorted_grey, FeatureSet& out) override;

 private:
  [[nodiscard]] cv::Mat rows_of(const cv::Mat& image) const;

  std::unique_ptr<FeatureExtractor> band_;
  cv::Size whole_size_;
  int first_row_;
};

/// Loads the model for the band, whose file lies beside the configured one's; null where there is
/// none. Throws as make_extractor() does where the file is not as it should be.
std::unique_ptr<FeatureExtractor> make_band_extractor(const MatchingConfig& config);

}  // namespace topoloc::matching

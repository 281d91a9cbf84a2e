// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/types.hpp"
#include "topoloc/matching/features.hpp"

#include <vector>

#include <opencv2/features2d.hpp>

namespace topoloc::matching {

/// SIFT with OpenCV's constants: for maps without any model file, and what
/// the learned features are held against. Descriptors are of length 1 as they come.
class SiftExtractor final : public FeatureExtractor {
 public:
  static constexpr const char* kName = "sift";  ///< in the configuration

  explicit SiftExtractor(const MatchingConfig& config);

  [[nodiscard]] const map::ModelIdentity& identity() const override { return identity_; }
  [[nodiscard]] int max_features() const override { return max_features_; }
  [[nodiscard]] cv::Size input_size() const override { return size_; }
  void set_mask(const cv::Mat& mask) override;
  void extract(const cv::Mat& undistorted_grey, FeatureSet& out) override;

 private:
  cv::Size size_;
  int max_features_;
  map::ModelIdentity identity_;
  cv::Ptr<cv::SIFT> sift_;
  cv::Mat mask_;
  // Of the current image; members for their memory.
  std::vector<cv::KeyPoint> keypoints_;
  cv::Mat descriptors_;
};

}  // namespace topoloc::matching

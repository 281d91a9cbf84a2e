// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/types.hpp"
#include "topoloc/matching/features.hpp"

#include "matching/onnx_model.hpp"

namespace topoloc::matching {

/// A network with detection, top N and descriptor sampling inside the graph: XFeat, ALIKED, DISK or
/// any other whose inputs and outputs are those of docs/models.md. The file says how long a
/// descriptor is.
class OnnxExtractor final : public FeatureExtractor {
 public:
  explicit OnnxExtractor(const MatchingConfig& config);

  [[nodiscard]] const map::ModelIdentity& identity() const override { return identity_; }
  [[nodiscard]] int max_features() const override { return max_features_; }
  [[nodiscard]] cv::Size input_size() const override { return size_; }
  void set_mask(const cv::Mat& mask) override;
  void extract(const cv::Mat& undistorted_grey, FeatureSet& out) override;

 private:
  void check_size(const cv::Mat& image, const char* what) const;

  cv::Size size_;
  int max_features_;
  OnnxModel model_;
  map::ModelIdentity identity_;
  std::span<float> image_;              ///< H x W, grey 0..255
  std::span<float> mask_;               ///< H x W, 1 keep, 0 ignore
  std::span<const float> keypoints_;    ///< N x 2, x y [px]
  std::span<const float> scores_;       ///< N, falling; 0: empty slot
  std::span<const float> descriptors_;  ///< N x descriptor_dim
};

}  // namespace topoloc::matching

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/matching/features.hpp"

#include "matching/onnx_model.hpp"

namespace topoloc::matching {

/// LightGlue (Lindenberger et al., ICCV 2023), trained for one kind of features: for XFeat the
/// small LighterGlue. The file says how long a descriptor is.
class LightGlueMatcher final : public FeatureMatcher {
 public:
  explicit LightGlueMatcher(const MatchingConfig& config);

  /// Sets with more features than the model takes: the first ones (highest scores) are used.
  /// Throws std::invalid_argument where descriptors have another length than the model's.
  void match(const FeatureSet& query, const FeatureSet& node,
             std::vector<FeatureMatch>& out) override;

 private:
  /// Inputs of one of the two images.
  struct Side {
    Side(OnnxModel& model, const std::string& suffix, int max_features);
    void fill(const FeatureSet& set);

    std::size_t dim;               ///< length of a descriptor
    std::span<float> keypoints;    ///< N x 2
    std::span<float> size;         ///< width, height
    std::span<float> descriptors;  ///< N x dim
    std::span<float> valid;        ///< N, 1 used, 0 empty slot
  };

  float min_score_;
  OnnxModel model_;
  Side query_;
  Side node_;
  std::span<const std::int32_t> matches_;  ///< node feature of each query feature, -1: none
  std::span<const float> scores_;
};

}  // namespace topoloc::matching

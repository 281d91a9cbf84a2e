// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/matching/features.hpp"

#include <vector>

namespace topoloc::matching {

/// Two features match if each is the other's most similar one (cosine of the descriptors) and the
/// similarity is at least `min_similarity`. Ties go to the smaller index. Score: the cosine.
class MutualNearestMatcher final : public FeatureMatcher {
 public:
  explicit MutualNearestMatcher(double min_similarity)
      : min_similarity_(static_cast<float>(min_similarity)) {}

  /// Throws std::invalid_argument where the descriptors have different lengths.
  void match(const FeatureSet& query, const FeatureSet& node,
             std::vector<FeatureMatch>& out) override;

 private:
  float min_similarity_;
  FeatureSet::DescriptorMatrix similarity_;  ///< query x node, kept for its memory
  std::vector<int> best_query_of_node_;
};

}  // namespace topoloc::matching

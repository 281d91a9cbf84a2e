// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/matching/features.hpp"

#include <vector>

namespace topoloc::matching {

/// The test that SIFT is known with: a query feature matches its nearest node feature if the
/// second-nearest is farther by far (distance of the best over that of the second-best at most
/// `max_ratio`). Of several queries for one node feature the nearest stays. Score: the cosine.
class RatioMatcher final : public FeatureMatcher {
 public:
  explicit RatioMatcher(double max_ratio) : max_ratio_(static_cast<float>(max_ratio)) {}

  /// Throws std::invalid_argument where the descriptors have different lengths.
  void match(const FeatureSet& query, const FeatureSet& node,
             std::vector<FeatureMatch>& out) override;

 private:
  float max_ratio_;
  FeatureSet::DescriptorMatrix similarity_;  ///< query x node, kept for its memory
  std::vector<int> match_of_node_;           ///< index into the matches, -1: none
};

}  // namespace topoloc::matching

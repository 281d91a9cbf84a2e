// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/ratio_matcher.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace topoloc::matching {

void RatioMatcher::match(const FeatureSet& query, const FeatureSet& node,
                         std::vector<FeatureMatch>& out) {
  out.clear();
  if (query.count == 0 || node.count < 2) {
    return;  // without a second-best there is no test
  }
  if (query.descriptor_dim != node.descriptor_dim) {
    throw std::invalid_argument("matching descriptors of length " +
                                std::to_string(query.descriptor_dim) + " with length " +
                                std::to_string(node.descriptor_dim));
  }
  similarity_.noalias() = query.descriptor_matrix() * node.descriptor_matrix().transpose();

  match_of_node_.assign(static_cast<std::size_t>(node.count), -1);
  for (int q = 0; q < query.count; ++q) {
    int best = 0;
    const float similarity = similarity_.row(q).maxCoeff(&best);
    float second = -1.0F;
    for (int n = 0; n < node.count; ++n) {
      second = n == best ? second : std::max(second, similarity_(q, n));
    }
    // Distances of unit vectors: |a - b|^2 = 2 - 2 a.b; quantised ones may be a little longer.
    const float best_sq = std::max(0.0F, 1.0F - similarity);
    const float second_sq = std::max(0.0F, 1.0F - second);
    if (!(best_sq < max_ratio_ * max_ratio_ * second_sq)) {
      continue;
    }
    const FeatureMatch match{.query = q, .node = best, .score = similarity};
    int& slot = match_of_node_[static_cast<std::size_t>(best)];
    if (slot < 0) {
      slot = static_cast<int>(out.size());
      out.push_back(match);
    } else if (similarity > out[static_cast<std::size_t>(slot)].score) {
      out[static_cast<std::size_t>(slot)] = match;
    }
  }
}

}  // namespace topoloc::matching

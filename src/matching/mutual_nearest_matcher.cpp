// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/mutual_nearest_matcher.hpp"

#include <stdexcept>
#include <string>

namespace topoloc::matching {

void MutualNearestMatcher::match(const FeatureSet& query, const FeatureSet& node,
                                 std::vector<FeatureMatch>& out) {
  out.clear();
  if (query.count == 0 || node.count == 0) {
    return;
  }
  if (query.descriptor_dim != node.descriptor_dim) {
    throw std::invalid_argument("matching descriptors of length " +
                                std::to_string(query.descriptor_dim) + " with length " +
                                std::to_string(node.descriptor_dim));
  }
  similarity_.noalias() = query.descriptor_matrix() * node.descriptor_matrix().transpose();

  best_query_of_node_.assign(static_cast<std::size_t>(node.count), 0);
  for (int q = 1; q < query.count; ++q) {
    for (int n = 0; n < node.count; ++n) {
      int& best = best_query_of_node_[static_cast<std::size_t>(n)];
      best = similarity_(q, n) > similarity_(best, n) ? q : best;
    }
  }
  for (int q = 0; q < query.count; ++q) {
    int best = 0;
    const float similarity = similarity_.row(q).maxCoeff(&best);
    if (similarity >= min_similarity_ && best_query_of_node_[static_cast<std::size_t>(best)] == q) {
      out.push_back({.query = q, .node = best, .score = similarity});
    }
  }
}

}  // namespace topoloc::matching

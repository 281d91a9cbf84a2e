// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "matching/lightglue_matcher.hpp"

#include "matching/model_files.hpp"

#include <algorithm>
#include <stdexcept>

namespace topoloc::matching {

LightGlueMatcher::Side::Side(OnnxModel& model, const std::string& suffix, int max_features)
    : dim(static_cast<std::size_t>(model.input_columns("descriptors" + suffix))),
      keypoints(model.input("keypoints" + suffix, {max_features, 2})),
      size(model.input("size" + suffix, {2})),
      descriptors(
          model.input("descriptors" + suffix, {max_features, static_cast<std::int64_t>(dim)})),
      valid(model.input("valid" + suffix, {max_features})) {}

void LightGlueMatcher::Side::fill(const FeatureSet& set) {
  if (set.count > 0 && static_cast<std::size_t>(set.descriptor_dim) != dim) {
    throw std::invalid_argument("lightglue: descriptors of length " +
                                std::to_string(set.descriptor_dim) + ", expected " +
                                std::to_string(dim));
  }
  const std::size_t used = std::min(valid.size(), static_cast<std::size_t>(set.count));
  // Empty slots are masked, but must hold numbers: 0 times NaN is NaN.
  std::fill(keypoints.begin(), keypoints.end(), 0.0F);
  std::fill(valid.begin(), valid.end(), 0.0F);
  std::fill(descriptors.begin() + static_cast<std::ptrdiff_t>(used * dim), descriptors.end(), 0.0F);
  std::copy_n(set.descriptors.begin(), used * dim, descriptors.begin());
  for (std::size_t i = 0; i < used; ++i) {
    keypoints[2 * i] = set.pixels_px[i].x();
    keypoints[2 * i + 1] = set.pixels_px[i].y();
    valid[i] = 1.0F;
  }
  size[0] = static_cast<float>(set.width_px);
  size[1] = static_cast<float>(set.height_px);
}

LightGlueMatcher::LightGlueMatcher(const MatchingConfig& config)
    : min_score_(static_cast<float>(config.min_match_score)),
      model_(lightglue_file(config), config.threads, config.execution_provider),
      query_(model_, "0", config.max_features),
      node_(model_, "1", config.max_features),
      matches_(model_.output<std::int32_t>("matches0", {config.max_features})),
      scores_(model_.output<float>("scores0", {config.max_features})) {
  model_.require_no_other_inputs();
}

void LightGlueMatcher::match(const FeatureSet& query, const FeatureSet& node,
                             std::vector<FeatureMatch>& out) {
  out.clear();
  query_.fill(query);
  node_.fill(node);
  if (query.count == 0 || node.count == 0) {
    return;
  }
  model_.run();
  // A model file of the user's own may answer with slots that hold no feature.
  const std::size_t queries = std::min(matches_.size(), static_cast<std::size_t>(query.count));
  for (std::size_t q = 0; q < queries; ++q) {
    if (matches_[q] >= 0 && matches_[q] < node.count && scores_[q] >= min_score_) {
      out.push_back({.query = static_cast<int>(q), .node = matches_[q], .score = scores_[q]});
    }
  }
}

}  // namespace topoloc::matching

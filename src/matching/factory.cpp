// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/features.hpp"
#include "topoloc/matching/mutual_nearest_matcher.hpp"

#include "matching/lighterglue_matcher.hpp"
#include "matching/xfeat_extractor.hpp"

#include <stdexcept>

namespace topoloc::matching {

std::unique_ptr<FeatureExtractor> make_extractor(const MatchingConfig& config) {
  validate(config);
  return std::make_unique<XFeatExtractor>(config);
}

std::unique_ptr<FeatureMatcher> make_matcher(const MatchingConfig& config) {
  validate(config);
  if (config.matcher == "lighterglue") {
    return std::make_unique<LighterGlueMatcher>(config);
  }
  if (config.matcher == "mutual") {
    return std::make_unique<MutualNearestMatcher>(config.min_similarity);
  }
  throw std::invalid_argument("matching.matcher: '" + config.matcher +
                              "' does not match by features alone");
}

}  // namespace topoloc::matching

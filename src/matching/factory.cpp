// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/features.hpp"
#include "topoloc/matching/image_pair_matcher.hpp"
#include "topoloc/matching/mutual_nearest_matcher.hpp"
#include "topoloc/matching/ratio_matcher.hpp"

#include "matching/detector_free_matcher.hpp"
#include "matching/feature_pair_matcher.hpp"
#include "matching/lightglue_matcher.hpp"
#include "matching/model_files.hpp"
#include "matching/onnx_extractor.hpp"
#include "matching/sift_extractor.hpp"

#include <stdexcept>

namespace topoloc::matching {

std::unique_ptr<FeatureExtractor> make_extractor(const MatchingConfig& config) {
  validate(config);
  if (config.extractor == SiftExtractor::kName) {
    return std::make_unique<SiftExtractor>(config);
  }
  return std::make_unique<OnnxExtractor>(config);
}

std::unique_ptr<FeatureMatcher> make_matcher(const MatchingConfig& config) {
  validate(config);
  if (config.matcher == "lighterglue" || config.matcher == "lightglue") {
    return std::make_unique<LightGlueMatcher>(config);
  }
  if (config.matcher == "mutual") {
    return std::make_unique<MutualNearestMatcher>(config.min_similarity);
  }
  if (config.matcher == "ratio") {
    return std::make_unique<RatioMatcher>(config.max_ratio);
  }
  throw std::invalid_argument("matching.matcher: '" + config.matcher +
                              "' does not match by features alone");
}

std::unique_ptr<ImagePairMatcher> make_pair_matcher(
    const MatchingConfig& config, const std::filesystem::path& detector_free_model) {
  validate(config);
  if (!detector_free_model.empty()) {
    return std::make_unique<DetectorFreeMatcher>(config, detector_free_model);
  }
  return std::make_unique<FeaturePairMatcher>(make_extractor(config), make_matcher(config));
}

std::vector<std::filesystem::path> pair_matcher_files(
    const MatchingConfig& config, const std::filesystem::path& detector_free_model) {
  if (!detector_free_model.empty()) {
    return {detector_free_model};
  }
  std::vector<std::filesystem::path> files{extractor_file(config)};
  if (config.matcher == "lighterglue" || config.matcher == "lightglue") {
    files.push_back(lightglue_file(config));
  }
  return files;
}

}  // namespace topoloc::matching

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/types.hpp"
#include "topoloc/matching/config.hpp"

#include <memory>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace topoloc::matching {

/// Features of one undistorted image. Built once for a largest number and reused.
struct FeatureSet {
  using DescriptorMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  FeatureSet() = default;
  FeatureSet(int max_features, int dim)
      : descriptor_dim(dim),
        pixels_px(static_cast<std::size_t>(max_features)),
        scores(static_cast<std::size_t>(max_features)),
        descriptors(static_cast<std::size_t>(max_features) * static_cast<std::size_t>(dim)) {}

  int count = 0;  ///< the first `count` entries below are valid
  int descriptor_dim = 0;
  int width_px = 0;  ///< size of the image they come from
  int height_px = 0;
  std::vector<Eigen::Vector2f> pixels_px;
  std::vector<float> scores;
  std::vector<float> descriptors;  ///< row-major count x descriptor_dim, rows of length 1

  [[nodiscard]] int capacity() const { return static_cast<int>(pixels_px.size()); }
  /// count x descriptor_dim
  [[nodiscard]] Eigen::Map<const DescriptorMatrix> descriptor_matrix() const {
    return {descriptors.data(), count, descriptor_dim};
  }
};

/// Finds features in undistorted images. Implementations are not thread-safe; one per thread.
class FeatureExtractor {
 public:
  virtual ~FeatureExtractor() = default;
  /// What a map must have been built with to be matched with these features.
  [[nodiscard]] virtual const map::ModelIdentity& identity() const = 0;
  [[nodiscard]] virtual int max_features() const = 0;
  [[nodiscard]] virtual cv::Size input_size() const = 0;
  /// Pixels that are 0 in `mask` (CV_8UC1, input size) bear no features, until the next call.
  virtual void set_mask(const cv::Mat& mask) = 0;
  /// `undistorted_grey`: CV_8UC1, input size (std::invalid_argument otherwise). Highest scores
  /// first. `out` is resized only if its capacity does not fit.
  virtual void extract(const cv::Mat& undistorted_grey, FeatureSet& out) = 0;
};

/// Feature `query` of the current image shows the same point as feature `node` of the map node.
struct FeatureMatch {
  int query = 0;
  int node = 0;
  float score = 0.0F;  ///< higher is surer; comparable within one matcher only
};

/// Matches two images by their features alone, one to one. Not thread-safe.
class FeatureMatcher {
 public:
  virtual ~FeatureMatcher() = default;
  virtual void match(const FeatureSet& query, const FeatureSet& node,
                     std::vector<FeatureMatch>& out) = 0;
};

/// Loads the model that `config` names ("sift" needs none). Throws std::runtime_error that names
/// the file, and what to do, where it is missing or has unexpected inputs.
std::unique_ptr<FeatureExtractor> make_extractor(const MatchingConfig& config);

/// "lighterglue", "lightglue", "mutual" or "ratio". ("guided" needs a prediction: see
/// GuidedMatcher.) Throws as make_extractor() does, and std::invalid_argument where the matcher was
/// not trained with the extractor.
std::unique_ptr<FeatureMatcher> make_matcher(const MatchingConfig& config);

}  // namespace topoloc::matching

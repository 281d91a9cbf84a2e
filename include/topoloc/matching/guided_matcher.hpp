// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/matching/config.hpp"
#include "topoloc/matching/features.hpp"
#include "topoloc/matching/predicted_camera.hpp"

#include <span>
#include <vector>

namespace topoloc::matching {

/// Matches a node with the current image using what the filter knows: each 3D point of the node is
/// searched only inside the gate of its predicted pixel, which holds the uncertainty of the pose
/// seen through the point's own depth. Best descriptor, ratio to the second best in the gate,
/// mutual. About 1 ms, no network.
///
/// The gate is sized by the prediction's covariance and never small: in a tight gate false matches
/// agree with the prediction, so that a filter fed with them hears its own echo. What is left of
/// false matches is the outlier removal's job.
class GuidedMatcher {
 public:
  /// `pixel_std_px`: keypoint noise per axis, added to both images' share of the gate.
  GuidedMatcher(const GuidedConfig& config, double min_similarity, double pixel_std_px);

  /// `node_points[i]` is the predicted pixel of node feature i; those not visible stay unmatched.
  /// Returns false, and no matches, where the median gate is wider than max_gate_px: the caller
  /// then matches without guidance.
  bool match(const FeatureSet& query, const FeatureSet& node,
             std::span<const ProjectedPoint> node_points, std::vector<FeatureMatch>& out);

 private:
  static constexpr float kNone = -2.0F;  ///< below every cosine
  struct Best {
    float first = kNone;   ///< best cosine so far
    float second = kNone;  ///< second best
    int index = -1;
  };
  void build_grid(const FeatureSet& query);
  /// Covariance of the distance between the predicted pixel and the keypoint.
  [[nodiscard]] Eigen::Matrix2d innovation(const ProjectedPoint& point) const;
  [[nodiscard]] bool near_image(const FeatureSet& query, const ProjectedPoint& point) const;
  void search(const FeatureSet& query, const FeatureSet& node, int n, const ProjectedPoint& point);

  GuidedConfig config_;
  float min_similarity_;
  double noise_variance_px2_;
  // Query features bucketed by cell (counting sort), rebuilt per frame.
  int columns_ = 0;
  int rows_ = 0;
  std::vector<int> cell_start_;
  std::vector<int> cell_features_;
  std::vector<int> cell_of_;
  std::vector<int> fill_position_;
  std::vector<Best> best_of_node_;
  std::vector<Best> best_of_query_;
  std::vector<double> gates_px_;
};

}  // namespace topoloc::matching

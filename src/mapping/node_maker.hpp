// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/types.hpp"
#include "topoloc/mapping/map_builder.hpp"
#include "topoloc/mapping/map_report.hpp"
#include "topoloc/mapping/node_selection.hpp"
#include "topoloc/matching/features.hpp"
#include "topoloc/matching/undistorter.hpp"

#include <memory>
#include <optional>

namespace topoloc::mapping {

/// Covariance of a node's pose (order and axes as in map::NodeDraft) from that of its vehicle pose.
Eigen::Matrix<double, 6, 6> node_covariance(const PlannedNode& node,
                                            const RigidTransform& T_imu_cam);

/// What all nodes of a map share. Read by all workers.
struct NodeContext {
  const CloudGrid& grid;
  const config::VehicleConfig& vehicle;
  const BuildConfig& config;
};

/// A finished node, or why there is none.
struct NodeOutcome {
  std::optional<NodeReject> rejected;
  map::NodeDraft draft;  ///< only if not rejected
  Figures figures;       ///< as far as it got
};

/// Turns one image and its pose into a map node (M1, M3, M7). Holds a model: one per thread.
class NodeMaker {
 public:
  explicit NodeMaker(const NodeContext& context);

  /// `raw`: CV_8UC1 as the camera gave it; empty where it did not decode.
  NodeOutcome make(const PlannedNode& node, const cv::Mat& raw);

 private:
  NodeContext context_;
  RigidTransform T_imu_cam_;
  matching::Undistorter undistorter_;
  std::unique_ptr<matching::FeatureExtractor> extractor_;
  matching::FeatureSet features_;
  cv::Mat undistorted_;
};

}  // namespace topoloc::mapping

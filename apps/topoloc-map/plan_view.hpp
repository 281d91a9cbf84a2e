// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/map_file.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>

namespace topoloc::apps {

/// World to pixels of a picture from above: x to the right, y up, the same scale both ways.
struct PlanView {
  Eigen::AlignedBox2d box_m;  ///< what the picture shows
  double px_per_m = 1.0;

  /// The largest scale at which `content_m` and a margin fit into a picture of at most that size.
  static PlanView of(const Eigen::AlignedBox2d& content_m, cv::Size largest_px);

  [[nodiscard]] cv::Size size_px() const;
  [[nodiscard]] cv::Point2d pixel(const Eigen::Vector2d& p_m) const;
};

/// The cloud in grey as the nodes of a map see it, from their depth and intensity images; CV_8UC3
/// of the view's size. Nothing but the background for a stripped map.
cv::Mat draw_cloud(const map::MapFile& map, const PlanView& view);

}  // namespace topoloc::apps

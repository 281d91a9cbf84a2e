// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "lidar_edges.hpp"

#include <opencv2/imgproc.hpp>

namespace topoloc::apps {

cv::Mat intensity_edges(const cv::Mat& filled) {
  // Canny steps of the square root: a marking on asphalt counts as much as a sign on a wall.
  constexpr double kWeak = 110.0;
  constexpr double kStrong = 260.0;
  cv::Mat smooth;
  cv::sqrt(filled / 255.0, smooth);
  smooth.convertTo(smooth, CV_8U, 255.0);
  cv::medianBlur(smooth, smooth, 5);
  cv::GaussianBlur(smooth, smooth, {5, 5}, 1.2);
  cv::Mat edges;
  cv::Canny(smooth, edges, kWeak, kStrong, 3, true);
  cv::Mat inside;
  cv::erode(filled > 0.0F, inside, cv::Mat::ones(7, 7, CV_8U));
  edges.setTo(0, ~inside);
  return edges;
}

cv::Mat depth_edges(const cv::Mat& filled_m) {
  // On the ground, the next pixel is farther too: by the square of its depth.
  constexpr double kStep_m = 0.4;
  constexpr double kStep = 0.08;
  cv::Mat farthest;
  cv::dilate(filled_m, farthest, cv::Mat::ones(3, 3, CV_8U));
  const cv::Mat edges = (filled_m > 0.0F) & (farthest > filled_m * (1.0 + kStep) + kStep_m);
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centres;
  const int count = cv::connectedComponentsWithStats(edges, labels, stats, centres, 8);
  // Specks are leaves and noise; what remains has a line to compare.
  constexpr int kMinPixels = 12;
  cv::Mat kept = cv::Mat::zeros(edges.size(), CV_8U);
  for (int i = 1; i < count; ++i) {
    if (stats.at<int>(i, cv::CC_STAT_AREA) >= kMinPixels) {
      kept.setTo(255, labels == i);
    }
  }
  return kept;
}

}  // namespace topoloc::apps

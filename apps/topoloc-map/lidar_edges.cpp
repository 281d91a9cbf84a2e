// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "lidar_edges.hpp"

#include <opencv2/imgproc.hpp>

namespace topoloc::apps {
namespace {

/// Without what is too small to be a line that an eye can compare: leaves, noise.
cv::Mat without_specks(const cv::Mat& edges, int min_pixels) {
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centres;
  const int count = cv::connectedComponentsWithStats(edges, labels, stats, centres, 8);
  cv::Mat kept(edges.size(), CV_8U, cv::Scalar(0));
  for (int v = 0; v < edges.rows; ++v) {
    for (int u = 0; u < edges.cols; ++u) {
      const int label = labels.at<int>(v, u);
      if (label > 0 && label < count && stats.at<int>(label, cv::CC_STAT_AREA) >= min_pixels) {
        kept.at<unsigned char>(v, u) = 255;
      }
    }
  }
  return kept;
}

}  // namespace

cv::Mat intensity_edges(const cv::Mat& stretched) {
  constexpr double kWeak = 110.0;
  constexpr double kStrong = 260.0;
  cv::Mat smooth;
  cv::medianBlur(stretched, smooth, 5);
  cv::GaussianBlur(smooth, smooth, {5, 5}, 1.2);
  cv::Mat edges;
  cv::Canny(smooth, edges, kWeak, kStrong, 3, true);
  cv::Mat inside;
  cv::erode(stretched > 0, inside, cv::Mat::ones(7, 7, CV_8U));
  edges.setTo(0, ~inside);
  return without_specks(edges, 16);
}

cv::Mat depth_edges(const cv::Mat& filled_m) {
  // On the ground the next pixel is farther, too: the more the farther it is.
  constexpr double kStep_m = 0.4;
  constexpr double kStep = 0.08;
  cv::Mat smooth_m;
  cv::medianBlur(filled_m, smooth_m, 3);
  cv::Mat farthest_m;
  cv::dilate(smooth_m, farthest_m, cv::Mat::ones(3, 3, CV_8U));
  const cv::Mat edges = (smooth_m > 0.0F) & (farthest_m > smooth_m * (1.0 + kStep) + kStep_m);
  return without_specks(edges, 16);
}

}  // namespace topoloc::apps

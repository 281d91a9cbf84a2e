// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "plan_view.hpp"

#include "node_images.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace topoloc::apps {
namespace {

constexpr double kMargin_m = 25.0;
/// Farther points are few a square metre, and the errors of a node's rotation blur them.
constexpr float kFarthest_m = 35.0F;
constexpr int kBackground = 25;

void add_node(const map::MapFile& map, std::size_t node, const PlanView& view, cv::Mat& sum,
              cv::Mat& count) {
  const NodeImages images = decode_images(map, node);
  if (images.depth_m.empty()) {
    return;
  }
  const PinholeCamera& camera = map.info().camera;
  const RigidTransform T_world_cam = map.T_world_cam(node);
  const cv::Rect inside({0, 0}, sum.size());
  for (int v = 0; v < images.depth_m.rows; ++v) {
    for (int u = 0; u < images.depth_m.cols; ++u) {
      const float depth_m = images.depth_m.at<float>(v, u);
      if (!(depth_m > 0.0F) || depth_m > kFarthest_m) {
        continue;
      }
      const Eigen::Vector3d point =
          T_world_cam * (static_cast<double>(depth_m) * camera.ray(Eigen::Vector2d(u, v)));
      const cv::Point2d exact = view.pixel(point.head<2>());
      const cv::Point at(static_cast<int>(std::floor(exact.x)),
                         static_cast<int>(std::floor(exact.y)));
      if (!inside.contains(at)) {
        continue;
      }
      constexpr float kWithoutIntensity = 100.0F;
      sum.at<float>(at) += images.intensity.empty()
                               ? kWithoutIntensity
                               : static_cast<float>(images.intensity.at<unsigned char>(v, u));
      count.at<float>(at) += 1.0F;
    }
  }
}

}  // namespace

PlanView PlanView::of(const Eigen::AlignedBox2d& content_m, cv::Size largest_px) {
  PlanView view;
  view.box_m = content_m;
  view.box_m.extend(content_m.min() - Eigen::Vector2d::Constant(kMargin_m));
  view.box_m.extend(content_m.max() + Eigen::Vector2d::Constant(kMargin_m));
  const Eigen::Vector2d sides_m = view.box_m.sizes();
  view.px_per_m = std::min(largest_px.width / sides_m.x(), largest_px.height / sides_m.y());
  return view;
}

cv::Size PlanView::size_px() const {
  const Eigen::Vector2d sides_m = box_m.sizes();
  return {std::max(1, static_cast<int>(std::lround(px_per_m * sides_m.x()))),
          std::max(1, static_cast<int>(std::lround(px_per_m * sides_m.y())))};
}

cv::Point2d PlanView::pixel(const Eigen::Vector2d& p_m) const {
  return {px_per_m * (p_m.x() - box_m.min().x()), px_per_m * (box_m.max().y() - p_m.y())};
}

cv::Mat draw_cloud(const map::MapFile& map, const PlanView& view) {
  cv::Mat sum = cv::Mat::zeros(view.size_px(), CV_32F);
  cv::Mat count = sum.clone();
  for (std::size_t i = 0; i < map.node_count(); ++i) {
    add_node(map, i, view, sum, count);
  }
  // Never as dark as the background.
  const cv::Mat grey = sum / cv::max(count, 1.0F) / 255.0;
  cv::Mat picture(view.size_px(), CV_8U, cv::Scalar(kBackground));
  cv::Mat shades;
  grey.convertTo(shades, CV_8U, 190.0, kBackground + 25);
  shades.copyTo(picture, count > 0.0F);
  cv::cvtColor(picture, picture, cv::COLOR_GRAY2BGR);
  return picture;
}

}  // namespace topoloc::apps

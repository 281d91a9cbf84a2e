// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/surface_track.hpp"

#include "topoloc/mapping/depth_check.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace topoloc::refinement {
namespace {

cv::Point2f to_point(const Eigen::Vector2d& pixel_px) {
  return {static_cast<float>(pixel_px.x()), static_cast<float>(pixel_px.y())};
}

Eigen::Vector2d to_pixel(const cv::Point2f& point) {
  return {static_cast<double>(point.x), static_cast<double>(point.y)};
}

/// plane_cam . R^T (x - p) = 1
Eigen::Vector4d to_world(const Eigen::Vector3d& plane_cam, const RigidTransform& T_world_cam) {
  const Eigen::Vector3d normal = T_world_cam.R * plane_cam;
  Eigen::Vector4d plane;
  plane << normal, 1.0 + normal.dot(T_world_cam.p);
  return plane / normal.norm();
}

/// Where a point of the first image is to appear in the second.
struct Prediction {
  Eigen::Vector2d surface_px;  // if it lies on its surface
  Eigen::Vector2d farther_px;  // if it lies on the same ray, max_times_farther as deep
  double std_px;               // of where it is seen, per axis
};

/// It moves along its epipolar line, but as something does that is much farther than its surface.
bool lies_behind(const Prediction& predicted, const Eigen::Vector2d& seen_px) {
  constexpr double kTelling = 3.0;  // deviations
  const double way_px = (predicted.farther_px - predicted.surface_px).norm();
  const auto [along_px, across_px] =
      mapping::epipolar_miss(predicted.surface_px, predicted.farther_px, seen_px);
  return across_px < kTelling * predicted.std_px &&
         along_px > std::max(kTelling * predicted.std_px, way_px);
}

struct Follow {
  const cv::Mat& from;
  const cv::Mat& to;
  const TrackConfig& config;

  std::vector<unsigned char> operator()(const std::vector<cv::Point2f>& start,
                                        std::vector<cv::Point2f>& end) const {
    std::vector<unsigned char> found;
    std::vector<float> error;
    cv::calcOpticalFlowPyrLK(
        from, to, start, end, found, error, cv::Size(config.window_px, config.window_px),
        config.pyramid_levels,
        cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01),
        cv::OPTFLOW_USE_INITIAL_FLOW);
    return found;
  }
};

}  // namespace

std::vector<SurfacePoint> find_surface_points(const cv::Mat& grey, const cv::Mat& mask,
                                              const mapping::RenderedView& view,
                                              const RigidTransform& T_world_cam,
                                              const mapping::LiftConfig& lift_config,
                                              const TrackConfig& config) {
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(grey, corners, config.max_corners, config.corner_quality,
                          config.corner_distance_px, mask);
  std::vector<SurfacePoint> points;
  for (const cv::Point2f& corner : corners) {
    const Eigen::Vector2d pixel_px = to_pixel(corner);
    const mapping::Lift lift = mapping::lift(view, pixel_px, lift_config);
    if (lift.verdict != mapping::LiftVerdict::kLifted || lift.plane_cam.isZero()) {
      continue;
    }
    const Eigen::Vector4d plane_world = to_world(lift.plane_cam, T_world_cam);
    if (std::abs(plane_world.z()) <= config.max_upward) {
      points.push_back({pixel_px, lift.depth_m, lift.depth_std_m, plane_world});
    }
  }
  return points;
}

FollowedPoints track(const cv::Mat& from, const std::vector<SurfacePoint>& points,
                     const cv::Mat& to, const cv::Mat& to_mask, const RigidTransform& T_to_from,
                     const PinholeCamera& camera, const TrackConfig& config) {
  std::vector<cv::Point2f> start;
  std::vector<cv::Point2f> end;
  std::vector<const SurfacePoint*> followed;
  std::vector<Prediction> predictions;
  const int margin_px = config.window_px / 2;
  for (const SurfacePoint& point : points) {
    const Eigen::Vector3d ray = camera.ray(point.pixel_px);
    const Eigen::Vector3d q_to = T_to_from * (point.depth_m * ray);
    const Eigen::Vector3d farther = T_to_from * (config.max_times_farther * point.depth_m * ray);
    constexpr double kNearest_m = 1.0;
    if (std::min(q_to.z(), farther.z()) < kNearest_m ||
        !camera.contains(camera.project(q_to), margin_px)) {
      continue;
    }
    const Eigen::Vector3d deeper = T_to_from * ((point.depth_m + point.depth_std_m) * ray);
    followed.push_back(&point);
    const Eigen::Vector2d surface_px = camera.project(q_to);
    const double depth_effect_px = (camera.project(deeper) - surface_px).norm();
    predictions.push_back(
        {surface_px, camera.project(farther), std::hypot(config.pixel_std_px, depth_effect_px)});
    start.push_back(to_point(point.pixel_px));
    end.push_back(to_point(surface_px));
  }
  FollowedPoints result;
  if (start.empty()) {
    return result;
  }
  const std::vector<unsigned char> forth = Follow{from, to, config}(start, end);
  std::vector<cv::Point2f> again = start;
  const std::vector<unsigned char> back = Follow{to, from, config}(end, again);
  for (std::size_t i = 0; i < start.size(); ++i) {
    const Eigen::Vector2d to_px = to_pixel(end[i]);
    if (forth[i] == 0 || back[i] == 0 || !camera.contains(to_px, 1.0) ||
        cv::norm(again[i] - start[i]) > config.max_forward_backward_px ||
        to_mask.at<unsigned char>(static_cast<int>(std::lround(to_px.y())),
                                  static_cast<int>(std::lround(to_px.x()))) == 0) {
      continue;
    }
    if (lies_behind(predictions[i], to_px)) {
      ++result.behind;
    } else {
      result.tracks.push_back({*followed[i], to_px, predictions[i].std_px});
    }
  }
  return result;
}

}  // namespace topoloc::refinement

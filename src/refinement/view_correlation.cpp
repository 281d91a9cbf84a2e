// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/view_correlation.hpp"

#include "topoloc/evaluation/median.hpp"

#include <cmath>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace topoloc::refinement {
namespace {

/// Median depth of the visible points in a square; 0 without any.
double median_depth(const mapping::RenderedView& view, const cv::Rect& square) {
  std::vector<float> depths;
  for (int v = square.y; v < square.y + square.height; ++v) {
    for (int u = square.x; u < square.x + square.width; ++u) {
      if (!view.is_hole(u, v)) {
        depths.push_back(view.depth_m[view.index(u, v)]);
      }
    }
  }
  return static_cast<double>(evaluation::median(std::move(depths)));
}

cv::Mat shrunk(const cv::Mat& field, int shrink) {
  if (shrink == 1) {
    return field;
  }
  cv::Mat out;
  cv::resize(field, out, field.size() / shrink, 0.0, 0.0, cv::INTER_AREA);
  return out;
}

/// The camera's field with a border of zeros, so that every patch has its full range.
cv::Mat padded(const cv::Mat& field, int border) {
  cv::Mat out;
  cv::copyMakeBorder(field, out, border, border, border, border, cv::BORDER_CONSTANT,
                     cv::Scalar(0.0, 0.0));
  return out;
}

}  // namespace

ViewCorrelation correlate(const GradientField& camera, const GradientField& intensity,
                          const mapping::RenderedView& view, const RigidTransform& T_world_cam,
                          int shrink, const CorrelationConfig& config) {
  ViewCorrelation result{shrink, config.range, {}};
  const int radius = config.patch_radius_px;
  const int side = 2 * (radius / shrink) + 1;
  const double elements = static_cast<double>(side) * side;
  const cv::Mat camera_field = padded(shrunk(camera.orientation, shrink), config.range);
  const cv::Mat intensity_field = shrunk(intensity.orientation, shrink);
  for (int v = radius; v + radius < view.camera.height_px; v += config.patch_step_px) {
    for (int u = radius; u + radius < view.camera.width_px; u += config.patch_step_px) {
      const cv::Rect square(u - radius, v - radius, 2 * radius + 1, 2 * radius + 1);
      const cv::Rect patch_at(square.x / shrink, square.y / shrink, side, side);
      if ((patch_at & cv::Rect({0, 0}, intensity_field.size())) != patch_at) {
        continue;
      }
      const cv::Mat patch = intensity_field(patch_at);
      if (cv::countNonZero(intensity.valid(square)) < config.min_valid_share * square.area() ||
          cv::norm(patch) < config.min_gradient_weight * std::sqrt(elements)) {
        continue;
      }
      const double depth_m = median_depth(view, square);
      if (depth_m <= 0.0 || depth_m > config.max_patch_depth_m) {
        continue;
      }
      // In the padded field the patch's own place begins at its own corner plus the border.
      const cv::Rect around(patch_at.x, patch_at.y, side + 2 * config.range,
                            side + 2 * config.range);
      const cv::Mat searched = camera_field(around);
      if (cv::norm(searched) < config.min_gradient_weight * std::sqrt(elements)) {
        continue;  // masked, or an empty sky
      }
      cv::Mat surface;
      cv::matchTemplate(searched, patch, surface, cv::TM_CCOEFF_NORMED);
      cv::patchNaNs(surface, 0.0);
      surface -= cv::mean(surface)[0];
      const Eigen::Vector2d pixel_px(u, v);
      CorrelationPatch found{pixel_px, T_world_cam * (depth_m * view.camera.ray(pixel_px)), {}};
      for (std::size_t level = 0; level < found.surfaces.size(); ++level) {
        cv::GaussianBlur(surface, found.surfaces[level], cv::Size(), config.smoothing[level]);
      }
      result.patches.push_back(std::move(found));
    }
  }
  return result;
}

double agreement(const ViewCorrelation& view, const CorrelationPatch& patch, std::size_t level,
                 const PinholeCamera& camera, const RigidTransform& T_cam_world, double radial) {
  Eigen::Vector3d q_cam = T_cam_world * patch.q_world;
  constexpr double kNearest_m = 0.5;
  if (q_cam.z() < kNearest_m) {
    return 0.0;
  }
  q_cam.head<2>() *= 1.0 + radial * q_cam.head<2>().squaredNorm() / (q_cam.z() * q_cam.z());
  const Eigen::Vector2d shift = (camera.project(q_cam) - patch.pixel_px) / view.shrink;
  const double x = shift.x() + view.range;
  const double y = shift.y() + view.range;
  if (!(x >= 0.0 && y >= 0.0 && x < 2 * view.range && y < 2 * view.range)) {
    return 0.0;
  }
  const int u = static_cast<int>(x);
  const int v = static_cast<int>(y);
  const double fu = x - u;
  const double fv = y - v;
  const auto* upper = patch.surfaces[level].ptr<float>(v) + u;
  const auto* lower = patch.surfaces[level].ptr<float>(v + 1) + u;
  return (1.0 - fv) *
             ((1.0 - fu) * static_cast<double>(upper[0]) + fu * static_cast<double>(upper[1])) +
         fv * ((1.0 - fu) * static_cast<double>(lower[0]) + fu * static_cast<double>(lower[1]));
}

}  // namespace topoloc::refinement

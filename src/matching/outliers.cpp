// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/outliers.hpp"

#include "topoloc/matching/predicted_camera.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

namespace topoloc::matching {
namespace {

constexpr double kMadToStd = 1.4826;  // of a normal distribution
constexpr double kConfidence = 0.9999;
constexpr int kMinInliers = 6;  // twice what P3P needs
constexpr int kRefinementRounds = 3;
constexpr double kPredictedSigmas = 3.0;

/// Shift f' - f of every match that has one.
std::vector<Eigen::Vector2d> finite_shifts(std::span<const MatchGeometry> matches) {
  std::vector<Eigen::Vector2d> shifts;
  shifts.reserve(matches.size());
  for (const MatchGeometry& match : matches) {
    const Eigen::Vector2d shift = match.predicted_px - match.pixel_px;
    if (shift.allFinite()) {
      shifts.push_back(shift);
    }
  }
  return shifts;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool agrees(const MatchGeometry& match, const PinholeCamera& camera, const RigidTransform& T,
            double limit_px) {
  const Eigen::Vector3d q = T * match.q_cam_m;
  return q.z() > kMinDepth_m && (camera.project(q) - match.pixel_px).norm() <= limit_px;
}

/// Points of the kept matches as OpenCV wants them.
struct PnpInput {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;

  PnpInput(std::span<const MatchGeometry> matches, const std::vector<std::uint8_t>& keep) {
    for (std::size_t i = 0; i < matches.size(); ++i) {
      if (keep[i] != 0) {
        const auto& [pixel, predicted, std_px, q] = matches[i];
        points.emplace_back(q.x(), q.y(), q.z());
        pixels.emplace_back(pixel.x(), pixel.y());
      }
    }
  }
};

RigidTransform to_transform(const cv::Mat& rotation_vector, const cv::Mat& translation) {
  cv::Mat rotation;
  cv::Rodrigues(rotation_vector, rotation);
  RigidTransform T;
  cv::cv2eigen(rotation, T.R);
  cv::cv2eigen(translation, T.p);
  return T;
}

/// Camera from predicted camera by RANSAC, then least squares on the inliers until they are stable.
std::optional<RigidTransform> consensus_pose(std::span<const MatchGeometry> matches,
                                             const PinholeCamera& camera,
                                             const OutlierConfig& config,
                                             std::vector<std::uint8_t>& keep) {
  const cv::Matx33d K(camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1);
  cv::Mat rotation_vector;
  cv::Mat translation;
  {
    // OpenCV seeds this RANSAC's generator with a constant at each call: same input, same result.
    const PnpInput all(matches, keep);
    if (all.points.size() < kMinInliers ||
        !cv::solvePnPRansac(all.points, all.pixels, K, cv::noArray(), rotation_vector, translation,
                            false, config.consensus_iterations,
                            static_cast<float>(config.consensus_px), kConfidence, cv::noArray(),
                            cv::SOLVEPNP_AP3P)) {
      return std::nullopt;
    }
  }
  const std::vector<std::uint8_t> candidates = keep;
  for (int round = 0; round < kRefinementRounds; ++round) {
    const RigidTransform T = to_transform(rotation_vector, translation);
    if (!T.R.allFinite() || !T.p.allFinite()) {
      return std::nullopt;
    }
    for (std::size_t i = 0; i < matches.size(); ++i) {
      keep[i] = candidates[i] != 0 && agrees(matches[i], camera, T, config.consensus_px) ? 1 : 0;
    }
    const PnpInput inliers(matches, keep);
    if (inliers.points.size() < kMinInliers) {
      return std::nullopt;
    }
    if (round + 1 < kRefinementRounds) {
      cv::solvePnPRefineLM(inliers.points, inliers.pixels, K, cv::noArray(), rotation_vector,
                           translation);
    }
  }
  return to_transform(rotation_vector, translation).inverse();
}

}  // namespace

void keep_near_mean_shift(std::span<const MatchGeometry> matches, double sigma_th_px,
                          std::vector<std::uint8_t>& keep) {
  keep.assign(matches.size(), 0);
  const std::vector<Eigen::Vector2d> shifts = finite_shifts(matches);
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& shift : shifts) {
    mean += shift / static_cast<double>(shifts.size());  // eq_mean_pixel
  }
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Eigen::Vector2d shift = matches[i].predicted_px - matches[i].pixel_px;
    // eq_matching_set_2d_2d; false for a shift that is not a number.
    keep[i] = ((shift - mean).array().abs() < 3.0 * sigma_th_px).all() ? 1 : 0;
  }
}

void keep_near_median_shift(std::span<const MatchGeometry> matches, double sigmas, double floor_px,
                            std::vector<std::uint8_t>& keep) {
  keep.assign(matches.size(), 0);
  const std::vector<Eigen::Vector2d> shifts = finite_shifts(matches);
  if (shifts.empty()) {
    return;
  }
  Eigen::Array2d centre;
  Eigen::Array2d deviation;
  std::vector<double> values(shifts.size());
  for (int axis = 0; axis < 2; ++axis) {
    std::transform(shifts.begin(), shifts.end(), values.begin(),
                   [&](const Eigen::Vector2d& shift) { return shift[axis]; });
    centre[axis] = median(values);
    std::transform(shifts.begin(), shifts.end(), values.begin(), [&](const Eigen::Vector2d& shift) {
      return std::abs(shift[axis] - centre[axis]);
    });
    deviation[axis] = kMadToStd * median(values);
  }
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Eigen::Array2d shift = matches[i].predicted_px - matches[i].pixel_px;
    const double least = std::max(floor_px, kPredictedSigmas * matches[i].predicted_std_px);
    keep[i] = ((shift - centre).abs() <= (sigmas * deviation).max(least)).all() ? 1 : 0;
  }
}

std::optional<RigidTransform> keep_pose_consensus(std::span<const MatchGeometry> matches,
                                                  const PinholeCamera& camera,
                                                  const OutlierConfig& config,
                                                  std::vector<std::uint8_t>& keep) {
  std::optional<RigidTransform> T_predicted_cam;
  try {
    T_predicted_cam = consensus_pose(matches, camera, config, keep);
  } catch (const cv::Exception&) {
    // OpenCV's solvers throw on degenerate points: no pose.
  }
  if (!T_predicted_cam) {
    std::fill(keep.begin(), keep.end(), std::uint8_t{0});
  }
  return T_predicted_cam;
}

void remove_outliers(std::span<const MatchGeometry> matches, const PinholeCamera& camera,
                     const OutlierConfig& config, std::vector<std::uint8_t>& keep) {
  if (config.method == "paper") {
    keep_near_mean_shift(matches, config.sigma_th_px, keep);
    return;
  }
  if (config.method == "none") {
    keep.assign(matches.size(), 1);
    return;
  }
  keep_near_median_shift(matches, config.median_sigmas, config.consensus_px, keep);
  keep_pose_consensus(matches, camera, config, keep);
}

}  // namespace topoloc::matching

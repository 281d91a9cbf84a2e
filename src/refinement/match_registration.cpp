// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/match_registration.hpp"

#include "topoloc/matching/predicted_camera.hpp"

#include "refinement/reprojection_fit.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

namespace topoloc::refinement {
namespace {

/// Matches that the prior allows, with a point of the cloud.
struct GatedMatches {
  std::vector<WorldMatch> matches;
  std::vector<BearingPair> bearings;  // from the prior's camera to the true one
  std::vector<double> chance;         // that a match anywhere in its gate agrees with a given pose

  [[nodiscard]] std::vector<WorldMatch> subset(const std::vector<std::size_t>& indices) const {
    std::vector<WorldMatch> result;
    result.reserve(indices.size());
    for (const std::size_t i : indices) {
      result.push_back(matches[i]);
    }
    return result;
  }
};

/// Only what is nearer than the prior's translation error is off its ray by more than a pixel.
double bearing_threshold_rad(double depth_m, const PinholeCamera& camera, const PosePrior& prior,
                             const MatchConfig& config) {
  const double pixel_rad = config.pixel_std_px / camera.fx_px;
  const double aside_rad = prior.std.tail<3>().mean() / depth_m;
  return config.inlier_sigmas * std::hypot(pixel_rad, aside_rad);
}

GatedMatches gate(std::span<const matching::PixelMatch> matches, const mapping::RenderedView& view,
                  const PosePrior& prior, const RigidTransform& T_imu_cam,
                  const mapping::LiftConfig& lift_config, const MatchConfig& config) {
  const PinholeCamera& camera = view.camera;
  const Eigen::Matrix3d& R = prior.T_world_imu.R;
  matching::PosePrediction prediction{prior.T_world_imu, {}};
  prediction.covariance.setZero();
  prediction.covariance.diagonal().head<3>() = prior.std.head<3>().cwiseAbs2();
  prediction.covariance.bottomRightCorner<3, 3>() =
      R * prior.std.tail<3>().cwiseAbs2().asDiagonal() * R.transpose();
  const matching::PredictedCamera predicted(camera, T_imu_cam, prediction);
  const double radius_px = config.inlier_sigmas * config.pixel_std_px;

  GatedMatches result;
  for (const matching::PixelMatch& match : matches) {
    const Eigen::Vector2d pixel0_px = match.pixel0_px.cast<double>();
    const Eigen::Vector2d pixel1_px = match.pixel1_px.cast<double>();
    const mapping::Lift lifted = mapping::lift(view, pixel0_px, lift_config);
    if (lifted.verdict != mapping::LiftVerdict::kLifted) {
      continue;
    }
    const Eigen::Vector3d p_world =
        predicted.T_world_cam() * (lifted.depth_m * camera.ray(pixel0_px));
    const matching::ProjectedPoint projected = predicted.project(p_world);
    const Eigen::Matrix2d C = projected.covariance + config.pixel_std_px * config.pixel_std_px *
                                                         Eigen::Matrix2d::Identity();
    const Eigen::Vector2d off_px = pixel1_px - projected.pixel_px;
    if (!projected.visible || off_px.dot(C.inverse() * off_px) > config.gate) {
      continue;
    }
    result.matches.push_back({p_world, pixel1_px});
    result.bearings.push_back({camera.ray(pixel0_px).normalized(),
                               camera.ray(pixel1_px).normalized(),
                               bearing_threshold_rad(lifted.depth_m, camera, prior, config)});
    result.chance.push_back(
        std::min(1.0, radius_px * radius_px / (config.gate * std::sqrt(C.determinant()))));
  }
  return result;
}

/// Pose of the camera by SQPnP (M5); nothing where its points are degenerate.
std::optional<RigidTransform> solve_sqpnp(const std::vector<WorldMatch>& matches,
                                          const RigidTransform& T_world_cam,
                                          const PinholeCamera& camera) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  const RigidTransform T_cam_world = T_world_cam.inverse();
  for (const WorldMatch& match : matches) {
    const Eigen::Vector3d q = T_cam_world * match.p_world;
    points.emplace_back(q.x(), q.y(), q.z());
    pixels.emplace_back(match.pixel_px.x(), match.pixel_px.y());
  }
  const cv::Matx33d K(camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1);
  RigidTransform T_found_prior;
  try {
    cv::Mat rotation_vector;
    cv::Mat translation;
    if (!cv::solvePnP(points, pixels, K, cv::noArray(), rotation_vector, translation, false,
                      cv::SOLVEPNP_SQPNP)) {
      return std::nullopt;
    }
    cv::Mat rotation;
    cv::Rodrigues(rotation_vector, rotation);
    cv::cv2eigen(rotation, T_found_prior.R);
    cv::cv2eigen(translation, T_found_prior.p);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  if (!T_found_prior.R.allFinite() || !T_found_prior.p.allFinite()) {
    return std::nullopt;
  }
  return T_world_cam * T_found_prior.inverse();
}

/// More agreeing matches than chance gives, in deviations of that number.
double match_significance(const GatedMatches& gated, std::size_t inliers) {
  constexpr double kFitted = 3.0;  // matches that six degrees of freedom can meet whatever they are
  double expected = 0.0;
  double variance = 0.0;
  for (const double p : gated.chance) {
    expected += p;
    variance += p * (1.0 - p);
  }
  return std::max(0.0, static_cast<double>(inliers) - kFitted - expected) /
         std::sqrt(std::max(1.0, variance));
}

}  // namespace

Registration register_by_matches(std::span<const matching::PixelMatch> matches,
                                 const mapping::RenderedView& view, const PosePrior& prior,
                                 const RigidTransform& T_imu_cam, const mapping::LiftConfig& lift,
                                 const MatchConfig& config) {
  Registration result;
  result.route = Route::kMatches;
  result.T_world_imu = prior.T_world_imu;
  result.covariance = prior.std.cwiseAbs2().asDiagonal();

  const PinholeCamera& camera = view.camera;
  const GatedMatches gated = gate(matches, view, prior, T_imu_cam, lift, config);
  constexpr std::size_t kMinInliers = 6;  // twice what a pose needs
  const auto consensus = rotation_ransac(gated.bearings, config.rotation);
  if (!consensus || consensus->inliers.size() < kMinInliers) {
    return result;
  }
  const auto fit_from = [&](const std::vector<WorldMatch>& inliers, const RigidTransform& start) {
    return fit_reprojection(inliers, start, prior, T_imu_cam, camera, config);
  };
  std::vector<WorldMatch> inliers = gated.subset(consensus->inliers);
  const RigidTransform T_world_cam = prior.T_world_imu * T_imu_cam;
  const RigidTransform T_cam_imu = T_imu_cam.inverse();
  const RigidTransform turned{T_world_cam.R * consensus->R_to_from.transpose(), T_world_cam.p};
  ReprojectionFit fit = fit_from(inliers, turned * T_cam_imu);
  if (const auto solved = solve_sqpnp(inliers, T_world_cam, camera)) {
    // From few and noisy points SQPnP may end far off: the better of both starts.
    const ReprojectionFit other = fit_from(inliers, *solved * T_cam_imu);
    fit = other.cost < fit.cost ? other : fit;
  }
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    inliers.clear();
    for (const WorldMatch& match : gated.matches) {
      if (reprojection_error(match, fit.T_world_imu, T_imu_cam, camera, config) <=
          config.inlier_sigmas) {
        inliers.push_back(match);
      }
    }
    if (inliers.size() < kMinInliers) {
      return result;
    }
    fit = fit_from(inliers, fit.T_world_imu);
  }
  result.T_world_imu = fit.T_world_imu;
  result.covariance = std::max(1.0, fit.mean_square) * fit.information.inverse();
  result.covariance.diagonal() += config.floor_std.cwiseAbs2();
  result.score = static_cast<double>(inliers.size()) / static_cast<double>(gated.matches.size());
  result.significance = match_significance(gated, inliers.size());
  return result;
}

}  // namespace topoloc::refinement

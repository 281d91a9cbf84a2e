// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/matching/config.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace topoloc::matching {

/// A match as the outlier removal sees it.
struct MatchGeometry {
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();      ///< f, found in the current image
  Eigen::Vector2d predicted_px = Eigen::Vector2d::Zero();  ///< f', eq_F_C_start_dash
  /// Standard deviation of predicted_px due to the prediction (largest direction) [px]
  double predicted_std_px = 0.0;
  Eigen::Vector3d q_cam_m = Eigen::Vector3d::Zero();  ///< point in the predicted camera's frame
};

/// L4 as in the paper: keeps matches whose shift f' - f is within 3 sigma_th of the mean shift, per
/// axis (eq_mean_pixel, eq_matching_set_2d_2d). `keep[i]` becomes 0 or 1.
void keep_near_mean_shift(std::span<const MatchGeometry> matches, double sigma_th_px,
                          std::vector<std::uint8_t>& keep);

/// The same with the median, which a third of wrong matches cannot move, and a limit per match: the
/// largest of `sigmas` median absolute deviations (as standard deviations), three standard
/// deviations of the prediction at the match's own depth, and `floor_px`. (One limit for all depths
/// would drop the near points, which know the position best.)
void keep_near_median_shift(std::span<const MatchGeometry> matches, double sigmas, double floor_px,
                            std::vector<std::uint8_t>& keep);

/// Of the matches kept so far, keeps those that agree with one camera pose: RANSAC over P3P,
/// refined on its inliers. The pose is found from the matches alone, so the prediction cannot pull
/// it. Deterministic. Returns the pose of the camera in the predicted camera's frame; without a
/// pose, none is kept.
std::optional<RigidTransform> keep_pose_consensus(std::span<const MatchGeometry> matches,
                                                  const PinholeCamera& camera,
                                                  const OutlierConfig& config,
                                                  std::vector<std::uint8_t>& keep);

/// The method that `config` names.
void remove_outliers(std::span<const MatchGeometry> matches, const PinholeCamera& camera,
                     const OutlierConfig& config, std::vector<std::uint8_t>& keep);

}  // namespace topoloc::matching

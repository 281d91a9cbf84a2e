// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/mapping/lift.hpp"
#include "topoloc/mapping/render.hpp"
#include "topoloc/matching/image_pair_matcher.hpp"
#include "topoloc/refinement/registration.hpp"
#include "topoloc/refinement/rotation_ransac.hpp"

#include <span>

namespace topoloc::refinement {

struct MatchConfig {
  /// Squared distance of a match from where the prior predicts it, in deviations: 99 % of two.
  double gate = 9.2;
  double pixel_std_px = 3.0;   ///< of a true match between intensity and camera, per axis
  double inlier_sigmas = 2.5;  ///< radius within which a match agrees with a pose
  double robust_sigmas = 2.0;  ///< Cauchy scale of a reprojection error
  /// Matches of a view share errors, as far as the matcher errs in like manner: so many weigh as
  /// one that is independent.
  double redundancy = 8.0;
  RotationRansacConfig rotation;
  /// The prior's deviations count so many times as large: it only holds what matches leave open.
  double prior_weakening = 2.0;
  /// Added to the covariance found: what all matches of a view share (theta [rad], t [m]).
  Vector6 floor_std = (Vector6() << 0.003, 0.003, 0.002, 0.05, 0.05, 0.05).finished();
};

/// A pose thought of, and deviations (theta [rad], t [m]; vehicle axes) of what it is off by.
struct PosePrior {
  RigidTransform T_world_imu;
  Vector6 std;
};

/// Finds the pose of one camera image from matches with the rendered intensities (route a, the
/// paper's Algorithm 1): gate by the prior, lift by depth (M3), rotation-only RANSAC (M4), SQPnP
/// and robust least squares on the inliers (M5).
///
/// `matches`: pixel0 in the view, pixel1 in the camera image undistorted into view.camera. `view`:
/// rendered at the prior's pose. The covariance is that of the normal equations times the mean
/// square of the residuals. Score: share of the matches inside the gate that agree. Significance:
/// how many more agree than of matches that lie anywhere in their gates, in deviations of that
/// number. Without a pose: the prior, with significance 0.
Registration register_by_matches(std::span<const matching::PixelMatch> matches,
                                 const mapping::RenderedView& view, const PosePrior& prior,
                                 const RigidTransform& T_imu_cam,
                                 const mapping::LiftConfig& lift = {},
                                 const MatchConfig& config = {});

}  // namespace topoloc::refinement

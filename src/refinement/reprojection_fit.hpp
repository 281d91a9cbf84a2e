// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/refinement/match_registration.hpp"

#include <span>

#include <Eigen/Core>

namespace topoloc::refinement {

/// A point of the cloud and the pixel of the camera image that shows it.
struct WorldMatch {
  Eigen::Vector3d p_world;
  Eigen::Vector2d pixel_px;
};

/// A pose that fits matches, and how well.
struct ReprojectionFit {
  RigidTransform T_world_imu;
  Matrix6 information;  ///< of (theta, t) if all matches had their stated deviation
  double mean_square;   ///< weighted, of the residuals in deviations
  double cost;          ///< robust sum of squares, prior included
};

/// Robust least squares over reprojection errors (Cauchy weights, Gauss-Newton), held weakly by
/// the prior. Deterministic.
ReprojectionFit fit_reprojection(std::span<const WorldMatch> matches, const RigidTransform& start,
                                 const PosePrior& prior, const RigidTransform& T_imu_cam,
                                 const PinholeCamera& camera, const MatchConfig& config);

/// Reprojection error in deviations; infinite behind the camera.
double reprojection_error(const WorldMatch& match, const RigidTransform& T_world_imu,
                          const RigidTransform& T_imu_cam, const PinholeCamera& camera,
                          const MatchConfig& config);

}  // namespace topoloc::refinement

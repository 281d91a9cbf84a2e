// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/state.hpp"
#include "topoloc/geometry/camera.hpp"

#include <optional>

namespace topoloc::estimation {

/// Camera of the vehicle as the estimator sees it: ideal pinhole and extrinsic.
struct CameraModel {
  PinholeCamera pinhole;
  RigidTransform T_cam_imu;
};

/// Points nearer to the image plane than this are not projected.
inline constexpr double kMinDepth_m = 0.1;

/// One 2D-3D match linearised where the point q lies in camera axes (L6, eq_cam_feat_firstorder).
///
/// Whatever pose is wrong, ours or a map node's, a map point moves in camera axes as part of a
/// rigid body: dq = omega x q + tau. So each match needs only its Jacobian by (omega, tau);
/// body_motion() turns a pose error into it, once for all matches.
struct ReprojectionLinearisation {
  Eigen::Vector2d z_px;           ///< residual, predicted minus measured pixel (eq_z_i)
  Eigen::Matrix<double, 2, 6> G;  ///< derivative of the residual by (omega [rad], tau [m])
};

/// Nothing if the point lies behind the camera or nearer than kMinDepth_m.
std::optional<ReprojectionLinearisation> linearise_reprojection(const PinholeCamera& camera,
                                                                const RigidTransform& T_cam_world,
                                                                const Eigen::Vector2d& pixel_px,
                                                                const Eigen::Vector3d& p_world_m);

/// Motion (omega, tau) in camera axes of points fixed to a body, by the body's pose error
/// (theta, p): R_true = R Exp(theta), p_true = p + dp with p in world axes.
PoseCovariance body_motion(const RigidTransform& T_cam_body, const Eigen::Matrix3d& R_cam_world);

/// T_cam_world of a state.
RigidTransform camera_pose(const NominalState& x, const CameraModel& camera);

/// Motion (omega, tau) of world points in camera axes by the error (theta, p) of the vehicle's
/// pose: the match's Jacobian by the state is H = G vehicle_motion (eq_hi_0, with its errata).
PoseCovariance vehicle_motion(const NominalState& x, const CameraModel& camera);

}  // namespace topoloc::estimation

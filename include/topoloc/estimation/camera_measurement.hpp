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

/// One 2D-3D match linearised at a state: h(x) = z + H dx + noise (eq_cam_feat_firstorder).
struct ReprojectionLinearisation {
  Eigen::Vector2d z_px;               ///< residual, predicted minus measured pixel (eq_z_i)
  Eigen::Matrix<double, 2, 6> H;      ///< by (theta, p); all other columns are zero (eq_hi_0)
  Eigen::Matrix<double, 2, 3> dz_dq;  ///< by the point in camera axes
};

/// Points nearer to the image plane than this are not projected.
inline constexpr double kMinDepth_m = 0.1;

/// Residual and Jacobian of one match (L6, with the errata on both blocks).
/// Nothing if the point lies behind the camera or nearer than kMinDepth_m.
std::optional<ReprojectionLinearisation> linearise_reprojection(const NominalState& x,
                                                                const CameraModel& camera,
                                                                const Eigen::Vector2d& pixel_px,
                                                                const Eigen::Vector3d& p_world_m);

/// Derivative of the residual by the pose error (theta, p) of the node that the map point hangs on:
/// p_world = p_node + R_node Exp(theta) p_in_node. See MatchedNode for the axes.
Eigen::Matrix<double, 2, 6> node_pose_jacobian(const NominalState& x, const CameraModel& camera,
                                               const ReprojectionLinearisation& linearisation,
                                               const Eigen::Vector3d& p_world_m,
                                               const Eigen::Matrix3d& R_world_node,
                                               const Eigen::Vector3d& p_world_node_m);

}  // namespace topoloc::estimation

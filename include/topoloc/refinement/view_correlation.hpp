// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/refinement/gradient_field.hpp"

#include <array>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace topoloc::refinement {

struct CorrelationConfig {
  int patch_radius_px = 20;           ///< at full resolution
  int patch_step_px = 28;             ///< at full resolution
  int range = 30;                     ///< largest shift, in pixels of the resolution correlated at
  double min_valid_share = 0.5;       ///< of a patch's pixels
  double min_gradient_weight = 0.15;  ///< root mean square over a patch; less is featureless
  double max_patch_depth_m = 60.0;
  /// Smoothing of the correlation surfaces, coarse to fine [pixels of that resolution].
  std::array<double, 3> smoothing{3.0, 2.0, 1.2};
};

/// Piece of the rendered cloud, and how well the camera image agrees with it when it is shifted.
struct CorrelationPatch {
  Eigen::Vector2d pixel_px;  ///< centre in the rendered view
  Eigen::Vector3d q_world;   ///< what is seen there
  /// Normalised correlation less its mean, by level of smoothing: (2 range + 1)^2, CV_32FC1,
  /// element (range + dv, range + du) for a shift of (du, dv) shrunk pixels.
  std::array<cv::Mat, 3> surfaces;
};

/// All patches of one view of the cloud against one camera image.
struct ViewCorrelation {
  int shrink = 1;  ///< pixels of the view that one element of a surface stands for
  int range = 0;   ///< elements on either side of the middle
  std::vector<CorrelationPatch> patches;
};

/// Correlates patch by patch, both fields averaged down by `shrink` first: far cheaper, and it sees
/// farther. `camera` and `intensity` are fields of the view's size.
ViewCorrelation correlate(const GradientField& camera, const GradientField& intensity,
                          const mapping::RenderedView& view, const RigidTransform& T_world_cam,
                          int shrink, const CorrelationConfig& config);

/// Value of a patch's surface if the camera is at T_world_cam; 0 beyond its range. `radial`: what
/// is left of a radial distortion in the undistorted image, times the squared radius.
double agreement(const ViewCorrelation& view, const CorrelationPatch& patch, std::size_t level,
                 const PinholeCamera& camera, const RigidTransform& T_cam_world,
                 double radial = 0.0);

}  // namespace topoloc::refinement

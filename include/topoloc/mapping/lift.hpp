// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/render.hpp"

#include <Eigen/Core>

namespace topoloc::mapping {

/// Rules for giving an image point its depth (M3).
struct LiftConfig {
  double min_radius_px = 3.0;   ///< neighbourhood to begin with; grows by 1.5 where points are few
  double max_radius_px = 10.0;  ///< sparse scan lines are several pixels apart
  int min_points = 8;
  double touch_radius_px = 1.5;  ///< a point this near speaks for the pixel itself
  /// Points further than this off the common plane are on another surface [m, and share of depth].
  double surface_tolerance_m = 0.15;
  double surface_tolerance = 0.015;
  double min_surface_share = 0.7;  ///< share of the neighbourhood that must lie on the plane
  /// Standard deviation of the depth of a surface in the cloud: scanner noise, scan poses.
  double cloud_std_m = 0.03;
  /// Standard deviation of where the feature really is: on a slanted surface it means depth.
  double pixel_std_px = 0.5;
  double max_relative_std = 0.1;  ///< less certain depths are not used
};

enum class LiftVerdict {
  kLifted,
  kNoPoints,      ///< hole in the cloud, or sky
  kDepthEdge,     ///< more than one surface around the point
  kExtrapolated,  ///< surface ends before the point
  kUncertain,     ///< depth_std_m above max_relative_std * depth_m
};

struct Lift {
  LiftVerdict verdict = LiftVerdict::kNoPoints;
  double depth_m = 0.0;      ///< Z along the optical axis; 0 unless lifted
  double depth_std_m = 0.0;  ///< standard deviation of depth_m; 0 unless lifted
  /// The surface around the point, plane . q_cam = 1 [1/m]; zero where its slope is unknown.
  Eigen::Vector3d plane_cam = Eigen::Vector3d::Zero();
};

/// Depth of an image point from the visible points around it: a plane, which in *inverse* depth is
/// affine in pixel coordinates, fitted to the neighbourhood. Never bridges an edge, never
/// extrapolates.
Lift lift(const RenderedView& view, const Eigen::Vector2d& pixel_px, const LiftConfig& config = {});

}  // namespace topoloc::mapping

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"

#include <string_view>

#include <Eigen/Core>

namespace topoloc::refinement {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Small motion (theta [rad], t [m]) of a vehicle pose in its own axes: R' = R Exp(theta),
/// p' = p + R t.
RigidTransform moved(const RigidTransform& T_world_imu, const Vector6& xi);

/// The inverse: xi with moved(T_from, xi) = T_to.
Vector6 motion_between(const RigidTransform& T_from, const RigidTransform& T_to);

/// How a registration is found.
enum class Route {
  kMatches,      ///< a: one view, by matches between LiDAR intensity and camera image
  kCorrelation,  ///< b: a window of views, by the agreement of their gradients
};
std::string_view name(Route route);

/// What a camera image, or several that hang together, said about the vehicle's pose in the cloud.
struct Registration {
  Route route = Route::kCorrelation;
  std::size_t keyframe = 0;                  ///< whose pose it is about
  RigidTransform T_world_imu;                ///< pose found
  Matrix6 covariance = Matrix6::Identity();  ///< of the motion (theta, t) from there to the truth
  /// So many registrations share their errors with this one: together they count as one.
  double shared_by = 1.0;
  double score = 0.0;  ///< of the pose found; higher is better, within one method
  /// What tells a find from chance, in standard deviations of chance: of the mean agreement of
  /// independent pieces of the scene (b), or of the number of matches that agree (a).
  double significance = 0.0;
};

}  // namespace topoloc::refinement

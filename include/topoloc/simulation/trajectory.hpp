// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"

#include <cstddef>
#include <vector>

#include <Eigen/Core>

/// Offline: drives through a made-up world and what the vehicle's sensors say of them.
namespace topoloc::simulation {

/// Motion of a rigid body at a moment.
struct BodyMotion {
  RigidTransform T_world_body;
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();       ///< of its origin, world axes
  Eigen::Vector3d acceleration_mps2 = Eigen::Vector3d::Zero();  ///< the same
  Eigen::Vector3d rate_radps = Eigen::Vector3d::Zero();         ///< body axes
  Eigen::Vector3d rate_change_radps2 = Eigen::Vector3d::Zero();

  /// Motion of a frame that is fixed on the body.
  [[nodiscard]] BodyMotion of(const RigidTransform& T_body_frame) const;
};

/// The truth: a pose that is twice continuously differentiable in time, with exact derivatives.
/// Position is a uniform cubic B-spline, rotation a cumulative one (C. Sommer et al., "Efficient
/// derivative computation for cumulative B-splines on Lie groups", CVPR 2020).
class Trajectory {
 public:
  /// `controls`: poses every `spacing_s` from -spacing_s on. The curve passes near them: it
  /// averages neighbours. At least four; throws std::invalid_argument otherwise.
  Trajectory(std::vector<RigidTransform> controls, double spacing_s);

  /// It is defined from 0 to here [s].
  [[nodiscard]] double duration_s() const { return duration_s_; }
  /// Outside the duration: that of the nearest end.
  [[nodiscard]] BodyMotion at(double time_s) const;

 private:
  std::vector<RigidTransform> controls_;
  std::vector<Eigen::Vector3d> turns_;  ///< rotation vector from a control pose to the next
  double spacing_s_;
  double duration_s_;
};

}  // namespace topoloc::simulation

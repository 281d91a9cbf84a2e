// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/simulation/road.hpp"
#include "topoloc/simulation/smooth_noise.hpp"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace topoloc::simulation {

/// The line that the middle of the rear axle follows: that of its lane, a constant offset of this
/// drive and a slow wander.
class Path {
 public:
  struct Options {
    double largest_offset_m = 0.3;  ///< constant over the drive
    double wander_m = 0.15;         ///< at most
  };
  /// `road` has to outlive it.
  Path(const Road& road, const Options& options, std::uint64_t key);

  [[nodiscard]] double left_m(double along_m) const;
  /// Pose on the road's surface without bumps: x along the path, z off the road.
  [[nodiscard]] RigidTransform T_world_path(double along_m) const;
  /// Way along the path per way along the route.
  [[nodiscard]] double stretch(double along_m) const;
  [[nodiscard]] double curvature_1pm(double along_m) const;

 private:
  /// Derivative of the position by the way along the route.
  [[nodiscard]] Eigen::Vector3d tangent(double along_m) const;
  [[nodiscard]] double left_slope(double along_m) const;
  [[nodiscard]] Eigen::Vector4d lane_controls(double along_m, double& share) const;

  const Road* road_;
  double offset_m_;
  double wander_m_;
  SmoothNoise wander_;
  std::vector<double> lane_left_m_;  ///< smoothed, every kLane_m
};

}  // namespace topoloc::simulation

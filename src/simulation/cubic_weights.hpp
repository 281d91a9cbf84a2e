// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <Eigen/Core>

namespace topoloc::simulation {

/// Weights of the four control values of a uniform cubic B-spline, `u` of the way from the second
/// to the third, and their derivatives by u.
inline Eigen::Vector4d cubic_weights(double u) {
  const double v = 1.0 - u;
  return Eigen::Vector4d(v * v * v, 3 * u * u * u - 6 * u * u + 4,
                         -3 * u * u * u + 3 * u * u + 3 * u + 1, u * u * u) /
         6.0;
}

inline Eigen::Vector4d cubic_weights_1(double u) {
  const double v = 1.0 - u;
  return Eigen::Vector4d(-v * v, 3 * u * u - 4 * u, -3 * u * u + 2 * u + 1, u * u) / 2.0;
}

inline Eigen::Vector4d cubic_weights_2(double u) { return {1 - u, 3 * u - 2, 1 - 3 * u, u}; }

/// Weights of the three differences between neighbours: sums of those above from the end on.
inline Eigen::Vector3d cumulative(const Eigen::Vector4d& weights) {
  return {weights[1] + weights[2] + weights[3], weights[2] + weights[3], weights[3]};
}

}  // namespace topoloc::simulation

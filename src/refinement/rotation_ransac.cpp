// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/rotation_ransac.hpp"

#include <cmath>
#include <random>

#include <Eigen/Geometry>

namespace topoloc::refinement {
namespace {

/// Axes that hang on two bearings alike: their bisector, and the normal of their plane.
Eigen::Matrix3d axes_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  Eigen::Matrix3d axes;
  axes.col(0) = (a + b).normalized();
  axes.col(1) = a.cross(b).normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

std::vector<std::size_t> agreeing_bearings(std::span<const BearingPair> pairs,
                                           const Eigen::Matrix3d& R_to_from) {
  std::vector<std::size_t> inliers;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (angle_between(R_to_from * pairs[i].from, pairs[i].to) <= pairs[i].threshold_rad) {
      inliers.push_back(i);
    }
  }
  return inliers;
}

}  // namespace

std::optional<RotationConsensus> rotation_ransac(std::span<const BearingPair> pairs,
                                                 const RotationRansacConfig& config) {
  if (pairs.size() < 2) {
    return std::nullopt;
  }
  std::mt19937_64 random(config.seed);
  std::optional<RotationConsensus> best;
  for (int i = 0; i < config.iterations; ++i) {
    // The standard's distributions differ from library to library.
    const BearingPair& first = pairs[random() % pairs.size()];
    const BearingPair& second = pairs[random() % pairs.size()];
    const double apart_rad = angle_between(first.from, second.from);
    // A rotation keeps angles.
    if (apart_rad < config.min_apart_rad ||
        std::abs(angle_between(first.to, second.to) - apart_rad) >
            first.threshold_rad + second.threshold_rad) {
      continue;
    }
    const Eigen::Matrix3d R_to_from =
        axes_of(first.to, second.to) * axes_of(first.from, second.from).transpose();
    std::vector<std::size_t> inliers = agreeing_bearings(pairs, R_to_from);
    if (!best || inliers.size() > best->inliers.size()) {
      best = RotationConsensus{R_to_from, std::move(inliers)};
    }
  }
  return best;
}

}  // namespace topoloc::refinement

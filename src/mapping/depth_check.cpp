// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/depth_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace topoloc::mapping {
namespace {

/// Where a point of the first image's ray appears in the second.
std::optional<Eigen::Vector2d> seen_from(const RigidTransform& T_to_from,
                                         const PinholeCamera& camera, const Eigen::Vector3d& ray,
                                         double depth_m) {
  constexpr double kNearest_m = 0.5;
  const Eigen::Vector3d q = T_to_from * (depth_m * ray);
  return q.z() > kNearest_m ? std::optional(camera.project(q)) : std::nullopt;
}

}  // namespace

EpipolarMiss epipolar_miss(const Eigen::Vector2d& expected_px, const Eigen::Vector2d& farther_px,
                           const Eigen::Vector2d& seen_px) {
  const Eigen::Vector2d direction = (farther_px - expected_px).normalized();
  const Eigen::Vector2d miss_px = seen_px - expected_px;
  return {miss_px.dot(direction),
          std::abs(direction.x() * miss_px.y() - direction.y() * miss_px.x())};
}

DepthWitness witness(const MovedFeature& moved, const RigidTransform& T_to_from,
                     const PinholeCamera& camera, const DepthCheckConfig& config) {
  const Eigen::Vector3d ray = camera.ray(moved.from_px);
  const auto expected = seen_from(T_to_from, camera, ray, moved.depth_m);
  const auto deeper = seen_from(T_to_from, camera, ray, moved.depth_m + moved.depth_std_m);
  const auto far = seen_from(T_to_from, camera, ray, config.telling_ratio * moved.depth_m);
  const auto near = seen_from(T_to_from, camera, ray, moved.depth_m / config.telling_ratio);
  // Where it cannot be seen the match is of something else, along the epipolar line at best.
  if (!expected || !deeper || !far || !camera.contains(*expected)) {
    return DepthWitness::kNone;
  }
  const double farther_px = (*far - *expected).norm();
  const double uncertain_px =
      config.sigmas * std::hypot(config.pixel_std_px, (*deeper - *expected).norm());
  // A point that hardly moves with its depth tells nothing of it.
  if (!(farther_px > config.pixel_std_px)) {
    return DepthWitness::kNone;
  }
  const auto [along_px, across_px] = epipolar_miss(*expected, *far, moved.to_px);
  if (across_px > config.max_across_px) {
    return DepthWitness::kNone;
  }
  const double nearer_px =
      near ? (*near - *expected).norm() : std::numeric_limits<double>::infinity();
  if (along_px > std::max(uncertain_px, farther_px) ||
      along_px < -std::max(uncertain_px, nearer_px)) {
    return DepthWitness::kContradicts;
  }
  return std::abs(along_px) < farther_px ? DepthWitness::kConfirms : DepthWitness::kNone;
}

std::vector<std::size_t> contradicted_depths(std::span<const map::Feature> features,
                                             const DepthWitnesses& witnesses,
                                             const DepthCheckConfig& config) {
  const auto lifted = [&](std::size_t i) { return features[i].depth_m > 0.0F; };
  const auto confirmed = [&](std::size_t i) { return witnesses.confirm[i] > 0; };
  const auto contradicted = [&](std::size_t i) {
    return witnesses.contradict[i] > 0 && !confirmed(i);
  };
  const auto on_one_surface = [&](const map::Feature& a, const map::Feature& b) {
    return (a.pixel_px - b.pixel_px).norm() <= static_cast<float>(config.reach_px) &&
           std::abs(a.depth_m - b.depth_m) <= static_cast<float>(config.reach_relative) * a.depth_m;
  };
  const auto lies_among_contradicted = [&](std::size_t i) {
    int against = 0;
    for (std::size_t k = 0; k < features.size(); ++k) {
      if (lifted(k) && on_one_surface(features[i], features[k])) {
        against += contradicted(k) ? 1 : 0;
        against -= confirmed(k) ? 1 : 0;
      }
    }
    return against > 0;
  };
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (lifted(i) && !confirmed(i) && (contradicted(i) || lies_among_contradicted(i))) {
      found.push_back(i);
    }
  }
  return found;
}

}  // namespace topoloc::mapping

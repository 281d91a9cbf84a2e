// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/map/feature_record.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace topoloc::mapping {

/// Rules for holding the depths that the cloud gives to a node's features against how these move
/// from the node's image to its neighbours'. Clouds hold what was there while they were scanned:
/// vehicles that drove along leave walls that no camera sees, and images show vehicles that are not
/// in the cloud.
struct DepthCheckConfig {
  /// A feature that moves as if it were that many times as far as its depth, or more, or as near,
  /// is not on the surface that the cloud has there.
  double telling_ratio = 1.5;
  double pixel_std_px = 1.5;   ///< of a match, per axis; in part of the nodes' relative poses
  double sigmas = 4.0;         ///< fewer deviations off tell nothing
  double max_across_px = 6.0;  ///< off the epipolar line: the match is wrong, not the depth
  double reach_px = 40.0;      ///< surfaces go on: so far from a feature that has been seen to move
  double reach_relative = 0.2;  ///< ... with depths that differ by no more than this share
};

/// How far from where it was expected a point is seen, along its epipolar line (positive: as what
/// is farther away) and across.
struct EpipolarMiss {
  double along_px;
  double across_px;  ///< not negative
};
/// `expected_px`: in the second image, by its depth; `farther_px`: with a larger one.
EpipolarMiss epipolar_miss(const Eigen::Vector2d& expected_px, const Eigen::Vector2d& farther_px,
                           const Eigen::Vector2d& seen_px);

/// What the images say of a depth.
enum class DepthWitness : std::uint8_t { kNone, kConfirms, kContradicts };

/// Two images with one motion between them, of matched features. `camera`: of both.
struct MovedFeature {
  Eigen::Vector2d from_px;
  double depth_m;  ///< in the first image, by the cloud; positive
  double depth_std_m;
  Eigen::Vector2d to_px;
};
DepthWitness witness(const MovedFeature& moved, const RigidTransform& T_to_from,
                     const PinholeCamera& camera, const DepthCheckConfig& config = {});

/// How many witnesses each feature of a node has.
struct DepthWitnesses {
  std::vector<std::uint8_t> confirm;
  std::vector<std::uint8_t> contradict;
};

/// Features whose depth is not to be used, by index: those that were contradicted and not
/// confirmed, and those near them on the same surface that nobody saw move, if most of the seen
/// ones around are contradicted.
std::vector<std::size_t> contradicted_depths(std::span<const map::Feature> features,
                                             const DepthWitnesses& witnesses,
                                             const DepthCheckConfig& config = {});

}  // namespace topoloc::mapping

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace topoloc::refinement {

/// The same point as two cameras in one place see it: unit vectors in their frames.
struct BearingPair {
  Eigen::Vector3d from;
  Eigen::Vector3d to;
  double threshold_rad;  ///< largest angle between R from and to at which they agree
};

struct RotationRansacConfig {
  int iterations = 1000;
  std::uint64_t seed = 1;
  double min_apart_rad = 0.05;  ///< two bearings nearer to each other do not fix a rotation
};

struct RotationConsensus {
  Eigen::Matrix3d R_to_from;
  std::vector<std::size_t> inliers;  ///< indices, ascending
};

/// Rotation-only RANSAC (M4, after Koide et al. 2023): hypothesises a rotation from two pairs of
/// bearings and counts those that agree. Far surer than a full pose where most pairs are wrong,
/// since two pairs suffice. Deterministic. Nothing if no two pairs agree on a rotation.
std::optional<RotationConsensus> rotation_ransac(std::span<const BearingPair> pairs,
                                                 const RotationRansacConfig& config = {});

}  // namespace topoloc::refinement

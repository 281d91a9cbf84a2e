// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/evaluation/trajectory.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/mapping/map_report.hpp"
#include "topoloc/mapping/node_reject.hpp"

#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace topoloc::mapping {

/// Which frames of a drive are used, by their order number in the camera log (from 0). Mapping
/// with even and localising with odd frames keeps the two apart on a single drive.
enum class FrameParity { kEven, kOdd, kAll };

/// Whether a frame is one of those to use.
bool is_used(std::size_t frame, FrameParity parity);

struct SelectionConfig {
  FrameParity frames = FrameParity::kAll;
  double every_m = 5.0;  ///< distance between nodes
  /// A turn this large since the last node also calls for one [rad].
  double every_rad = 15.0 * std::numbers::pi / 180.0;
  std::int64_t max_pose_gap_ns = 500'000'000;  ///< the trajectory is not interpolated across more
};

/// A frame that becomes a node.
struct PlannedNode {
  std::size_t frame = 0;  ///< order number in the camera log
  std::int64_t time_ns = 0;
  RigidTransform T_world_imu;
  /// Of the pose's error (theta [rad], t [m]) in the vehicle's own axes: R_true = R Exp(theta),
  /// p_true = p + R t.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::optional<NodeReject> rejected = std::nullopt;  ///< its pose is no good
  Figures figures = {};                               ///< of its pose
};

struct Selection {
  std::vector<PlannedNode> nodes;
  std::size_t frames_of_other_parity = 0;
  std::size_t frames_without_pose = 0;  ///< outside the trajectory, or in a gap of it
  double travelled_m = 0.0;             ///< along the frames that have a pose
};

/// Chooses frames at even spacing along the way: the first with a pose, then whichever comes
/// nearest to `every_m` (straight line) from the last node, or has turned by `every_rad`.
/// `times_ns` strictly increasing. Throws std::invalid_argument on a spacing that is not positive.
Selection select_nodes(std::span<const std::int64_t> times_ns,
                       const evaluation::Trajectory& trajectory, const SelectionConfig& config);

}  // namespace topoloc::mapping

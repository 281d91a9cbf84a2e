// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

/// What the estimator takes in. Times are int64 Unix nanoseconds on one time line.
namespace topoloc::estimation {

inline double seconds(std::int64_t duration_ns) { return static_cast<double>(duration_ns) * 1e-9; }

/// One inertial sample in the IMU frame.
struct ImuSample {
  std::int64_t time_ns = 0;
  Eigen::Vector3d specific_force_mps2 = Eigen::Vector3d::Zero();  ///< about +g on z at rest, level
  Eigen::Vector3d angular_rate_radps = Eigen::Vector3d::Zero();
};

/// Vehicle speed from the wheels.
struct SpeedSample {
  std::int64_t time_ns = 0;
  double speed_mps =
      0.0;  ///< mean of the configured wheels, forward positive, scale not yet applied
};

/// One 2D-3D correspondence of the current image with a map node (the paper's set S').
struct MapMatch {
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();   ///< in the undistorted current image
  Eigen::Vector3d p_world_m = Eigen::Vector3d::Zero();  ///< map point
  double pixel_std_px = 1.0;                            ///< standard deviation per axis
  int node_slot = 0;                                    ///< index into MapMatchSet::nodes
};

/// A node that a match set refers to, with the uncertainty that all its matches share.
struct MatchedNode {
  std::uint32_t node_id = 0;
  Eigen::Matrix3d R_world_cam = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_world_cam = Eigen::Vector3d::Zero();
  /// Covariance of the node's pose error (theta [rad], p [m]): R_true = R Exp(theta) in the node's
  /// camera axes, p_true = p + dp in world axes. Zero: the node is taken as exact.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

inline constexpr int kMaxMatches = 2048;
inline constexpr int kMaxMatchedNodes = 4;

/// All matches of one camera frame. Large (about 130 kB): construct once, reuse.
struct MapMatchSet {
  std::int64_t frame_time_ns = 0;  ///< mid-exposure
  int node_count = 0;
  std::array<MatchedNode, kMaxMatchedNodes> nodes;
  int match_count = 0;
  std::vector<MapMatch> matches = std::vector<MapMatch>(kMaxMatches);  ///< never resized

  /// Copies what is in use, without allocation.
  void assign(const MapMatchSet& other) {
    frame_time_ns = other.frame_time_ns;
    node_count = other.node_count;
    nodes = other.nodes;
    match_count = other.match_count;
    std::copy_n(other.matches.begin(), match_count, matches.begin());
  }
};

}  // namespace topoloc::estimation

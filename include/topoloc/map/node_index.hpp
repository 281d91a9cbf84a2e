// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/map/map_file.hpp"

#include <cstdint>
#include <memory>
#include <span>

namespace topoloc::map {

/// Looks nodes up by position and heading (M9, L2): a kd-tree over the positions, and only nodes
/// that look the same way. Copies what it needs: the MapFile may go.
class NodeIndex {
 public:
  explicit NodeIndex(const MapFile& map);
  ~NodeIndex();
  NodeIndex(NodeIndex&&) noexcept;
  NodeIndex& operator=(NodeIndex&&) noexcept;

  /// The nodes nearest to a camera pose, at most k, out.size() and 64, nearest position first
  /// (the smaller id first among equals).
  ///
  /// Only nodes within max_distance_m whose optical axis is within max_heading_rad of the pose's:
  /// a node seen in the opposite direction never crowds out one seen in this one. Returns how many
  /// ids were written; 0 for a pose that is not finite. Never allocates, never throws.
  [[nodiscard]] int nearest(const RigidTransform& T_world_cam, int k, double max_distance_m,
                            double max_heading_rad, std::span<std::uint32_t> out) const noexcept;

 private:
  class Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace topoloc::map

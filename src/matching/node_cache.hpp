// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/measurements.hpp"
#include "topoloc/map/map_file.hpp"
#include "topoloc/matching/features.hpp"

#include <cstdint>
#include <list>
#include <vector>

namespace topoloc::matching {

/// A map node unpacked for matching.
struct NodeFeatures {
  estimation::MatchedNode node;
  bool intact =
      false;  ///< false: its block in the map file is damaged, and nothing below is filled
  FeatureSet features;
  /// Of each feature (L5, node pixel unprojected with the node's depth); depth 0: not lifted.
  std::vector<Eigen::Vector3d> points_world_m;
  std::vector<float> depths_m;
  std::vector<float> depth_stds_m;

  [[nodiscard]] bool lifted(int i) const { return depths_m[static_cast<std::size_t>(i)] > 0.0F; }
};

/// The nodes used last: a node is seen by tens of frames, and unpacked once.
class NodeCache {
 public:
  static constexpr std::size_t kNodes = 2 * estimation::kMaxMatchedNodes;

  explicit NodeCache(const map::MapFile& map) : map_(&map) {}

  /// Stays valid while no more than kNodes - 1 other nodes are asked for.
  const NodeFeatures& node(std::uint32_t id);

 private:
  void unpack(std::uint32_t id, NodeFeatures& out) const;

  const map::MapFile* map_;
  std::list<NodeFeatures> nodes_;  ///< used last first; an evicted entry's memory is used again
};

}  // namespace topoloc::matching

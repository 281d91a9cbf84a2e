// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "matching/node_cache.hpp"

#include <algorithm>

namespace topoloc::matching {

const NodeFeatures& NodeCache::node(std::uint32_t id) {
  auto found = std::find_if(nodes_.begin(), nodes_.end(),
                            [id](const NodeFeatures& entry) { return entry.node.node_id == id; });
  if (found == nodes_.end()) {
    if (nodes_.size() < kNodes) {
      nodes_.emplace_back();
    }
    found = std::prev(nodes_.end());
    unpack(id, *found);
  }
  nodes_.splice(nodes_.begin(), nodes_, found);
  return nodes_.front();
}

void NodeCache::unpack(std::uint32_t id, NodeFeatures& out) const {
  out.intact = map_->node_intact(id);
  if (!out.intact) {
    out.node.node_id = id;
    out.features.count = 0;
    return;
  }
  const map::NodeView view = map_->node(id);
  const map::MapInfo& info = map_->info();
  out.node = {.node_id = id,
              .R_world_cam = view.T_world_cam.R,
              .p_world_cam = view.T_world_cam.p,
              .covariance = view.covariance};
  const std::size_t count = view.features.size();
  if (out.features.capacity() < static_cast<int>(count) ||
      out.features.descriptor_dim != info.model.descriptor_dim) {
    out.features = FeatureSet(static_cast<int>(count), info.model.descriptor_dim);
  }
  out.features.count = static_cast<int>(count);
  out.features.width_px = info.camera.width_px;
  out.features.height_px = info.camera.height_px;
  out.points_world_m.resize(count);
  out.depths_m.resize(count);
  out.depth_stds_m.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const map::FeatureRecord& record = view.features[i];
    out.features.pixels_px[i] = record.pixel_px();
    out.features.scores[i] = record.score();
    out.depths_m[i] = record.depth_m;
    out.depth_stds_m[i] = record.depth_std_m();
    out.points_world_m[i] = view.T_world_cam * record.point_cam(info.camera);
  }
  map::decode_descriptors(view.descriptors,
                          std::span(out.features.descriptors).first(view.descriptors.size()));
}

}  // namespace topoloc::matching

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/summary.hpp"

#include <algorithm>
#include <numeric>

namespace topoloc::map {

Spread Spread::of(std::vector<double> values) {
  if (values.empty()) {
    return {};
  }
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return {values.front(), 0.5 * (values[(n - 1) / 2] + values[n / 2]), sum / static_cast<double>(n),
          values.back()};
}

MapSummary summarise(const MapFile& map) {
  std::vector<double> spacing_m;
  std::vector<double> features;
  std::vector<double> lifted_share;
  std::vector<double> depth_std_m;
  for (std::size_t i = 0; i < map.node_count(); ++i) {
    const NodeQuality quality = map.node(i).quality;
    features.push_back(static_cast<double>(quality.feature_count));
    lifted_share.push_back(static_cast<double>(quality.lifted_share()));
    if (quality.lifted_count > 0) {
      depth_std_m.push_back(static_cast<double>(quality.mean_depth_std_m));
    }
    if (i > 0) {
      spacing_m.push_back((map.T_world_cam(i).p - map.T_world_cam(i - 1).p).norm());
    }
  }

  MapSummary summary;
  summary.node_count = map.node_count();
  summary.first_time_ns = map.node(0).time_ns;
  summary.last_time_ns = map.node(map.node_count() - 1).time_ns;
  summary.length_m = std::accumulate(spacing_m.begin(), spacing_m.end(), 0.0);
  summary.spacing_m = Spread::of(spacing_m);
  for (std::size_t i = 0; i < spacing_m.size(); ++i) {
    if (spacing_m[i] > MapSummary::kGapFactor * summary.spacing_m.median) {
      summary.gaps.push_back({static_cast<std::uint32_t>(i), spacing_m[i]});
    }
  }
  summary.features = Spread::of(std::move(features));
  summary.lifted_share = Spread::of(std::move(lifted_share));
  summary.depth_std_m = Spread::of(std::move(depth_std_m));
  return summary;
}

}  // namespace topoloc::map

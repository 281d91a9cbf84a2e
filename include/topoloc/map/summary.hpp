// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/map_file.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace topoloc::map {

/// Smallest, middle, mean and largest of some values; zeros if there are none.
struct Spread {
  double min = 0.0;
  double median = 0.0;
  double mean = 0.0;
  double max = 0.0;

  static Spread of(std::vector<double> values);
};

/// A place where the next node is much farther away than usual.
struct Gap {
  std::uint32_t after_node = 0;  ///< the gap is between this node and the next
  double length_m = 0.0;
};

/// What a map holds, in figures; from the node table alone.
struct MapSummary {
  /// A spacing of more than this many times the median is a gap.
  static constexpr double kGapFactor = 2.0;

  std::size_t node_count = 0;
  std::int64_t first_time_ns = 0;
  std::int64_t last_time_ns = 0;
  double length_m = 0.0;  ///< along the nodes in order of time, gaps included
  Spread spacing_m;       ///< between consecutive nodes
  std::vector<Gap> gaps;  ///< in order of time
  Spread features;        ///< per node
  Spread lifted_share;    ///< per node
  Spread depth_std_m;     ///< mean of each node that has lifted features
};

MapSummary summarise(const MapFile& map);

}  // namespace topoloc::map

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/map/map_file.hpp"
#include "topoloc/map/summary.hpp"
#include "topoloc/mapping/map_report.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace topoloc::apps {

/// A planned node: what the build report says of it and what the map holds.
struct QualityNode {
  std::optional<std::uint32_t> id;  ///< in the map; none if it was rejected
  double along_m = 0.0;             ///< way from the first planned node, straight between nodes
  /// Of accepted ones, with the figures of the map's own tables.
  mapping::NodeReport report;

  [[nodiscard]] bool accepted() const { return !report.rejected; }
  [[nodiscard]] std::optional<double> figure(const std::string& name) const;
};

/// Figures of accepted nodes that come from the map, whatever the report says.
inline constexpr const char* kPositionStd = "position_std_m";
inline constexpr const char* kRotationStd = "rotation_std_deg";
inline constexpr const char* kLiftedShare = "lifted_share";

/// Build report and node table of a map, joined. Of a map without report (older programs) the
/// accepted nodes alone are known, without their frames.
struct MapQuality {
  bool has_report = false;
  mapping::MapReport build;  ///< without its nodes, which are below
  std::vector<QualityNode> nodes;
  std::vector<mapping::NodeGap> gaps;  ///< indices into `nodes`
  std::map<std::string, std::size_t> rejected;

  [[nodiscard]] std::size_t accepted() const;
  /// Names of all figures; those of the map first.
  [[nodiscard]] std::vector<std::string> figure_names() const;
  /// Values of a figure over the accepted nodes, or over those rejected for a reason.
  [[nodiscard]] std::vector<double> values(
      const std::string& figure, const std::optional<std::string>& rejected_for = {}) const;
};

/// Throws map::MapError, or std::runtime_error on a report that does not fit the map; both name
/// the file.
MapQuality read_quality(const map::MapFile& map);

}  // namespace topoloc::apps

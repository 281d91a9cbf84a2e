// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace topoloc::mapping {

/// Numbers by name; the name ends in the unit ("mean_depth_std_m", "track_residual_px").
using Figures = std::map<std::string, double>;

/// What became of a planned node.
struct NodeReport {
  std::size_t frame = 0;  ///< order number in the camera log
  std::int64_t time_ns = 0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< of the IMU in the world
  std::optional<std::string> rejected;                   ///< why it is not in the map
  Figures figures;  ///< what the verdict rests on; values that are not finite do not get into JSON
};

/// How a map came about: goes into the map file (docs/map-format.md, REPT).
struct MapReport {
  std::string creator;
  std::string refine = "none";  ///< how the poses were found; "none": as the trajectory says
  std::uint64_t cloud_points = 0;
  bool cloud_has_intensity = false;
  std::vector<NodeReport> nodes;  ///< all that were planned, in order of time
};

/// Two accepted neighbours that are far apart.
struct NodeGap {
  std::size_t after = 0;   ///< index of the node before the gap
  std::size_t before = 0;  ///< index of the node behind it
  double length_m = 0.0;   ///< along the rejected nodes between them
};
inline constexpr double kReportedGap_m = 25.0;

/// Gaps of more than kReportedGap_m between neighbouring accepted nodes.
std::vector<NodeGap> find_gaps(std::span<const NodeReport> nodes);

/// Number of rejected nodes by reason.
std::map<std::string, std::size_t> count_rejected(std::span<const NodeReport> nodes);

/// The report as JSON text, totals included. The same report always gives the same bytes.
std::string to_json(const MapReport& report);

/// Inverse of to_json(); totals are not read. Throws std::runtime_error that says what is wrong.
MapReport parse_map_report(std::string_view json);

}  // namespace topoloc::mapping

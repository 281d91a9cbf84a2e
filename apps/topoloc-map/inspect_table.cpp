// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "inspect_table.hpp"

#include <algorithm>
#include <cstdio>
#include <string>

#include <fmt/core.h>

namespace topoloc::apps {
namespace {

using map::MapFile;
using map::MapInfo;
using map::MapSummary;
using map::SectionInfo;
using map::Spread;

void print_spread(const char* name, const Spread& s, int decimals) {
  std::printf("%-18s min %.*f, median %.*f, mean %.*f, max %.*f\n", name, decimals, s.min, decimals,
              s.median, decimals, s.mean, decimals, s.max);
}

void print_map(const MapFile& map, const MapSummary& summary) {
  const MapInfo& info = map.info();
  const topoloc::PinholeCamera& camera = info.camera;
  std::printf("%-18s %s\n", "map", map.path().c_str());
  std::printf("%-18s %s\n", "made by", info.creator.c_str());
  std::printf("%-18s %s\n", "model", to_string(info.model).c_str());
  std::printf("%-18s %d x %d px, f %.3f %.3f, c %.3f %.3f\n", "camera", camera.width_px,
              camera.height_px, camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px);
  std::printf("%-18s %.3f %.3f %.3f m in %s\n", "origin", info.origin_m.x(), info.origin_m.y(),
              info.origin_m.z(), info.crs.empty() ? "a local frame" : info.crs.c_str());
  std::printf("%-18s %zu over %.1f m and %.1f s\n", "nodes", summary.node_count, summary.length_m,
              1e-9 * static_cast<double>(summary.last_time_ns - summary.first_time_ns));
  print_spread("spacing [m]", summary.spacing_m, 2);
  std::printf("%-18s %zu of more than %.0f times the median spacing\n", "gaps", summary.gaps.size(),
              MapSummary::kGapFactor);
  constexpr std::size_t kListedGaps = 10;
  for (std::size_t i = 0; i < std::min(summary.gaps.size(), kListedGaps); ++i) {
    std::printf("%-18s %.2f m after node %u\n", "", summary.gaps[i].length_m,
                summary.gaps[i].after_node);
  }
  print_spread("features per node", summary.features, 1);
  print_spread("lifted share", summary.lifted_share, 3);
  print_spread("depth std [m]", summary.depth_std_m, 3);
  std::printf("%-18s %s\n", "images",
              !map.has_images()            ? "no (stripped)"
              : map.has_intensity_images() ? "camera, depth, LiDAR intensity"
                                           : "camera, depth");
  std::printf(
      "%-18s %llu bytes, %.1f kB a node\n", "size",
      static_cast<unsigned long long>(map.file_size()),
      1e-3 * static_cast<double>(map.file_size()) / static_cast<double>(summary.node_count));
  for (const SectionInfo& section : map.sections()) {
    std::printf("%-18s %s version %u, %llu bytes at %llu%s\n", "", section.name.c_str(),
                section.version, static_cast<unsigned long long>(section.length),
                static_cast<unsigned long long>(section.offset),
                section.known ? "" : " (unknown, ignored)");
  }
}

/// "coverage 0.21, features 512": the medians over some nodes.
std::string medians(const MapQuality& quality, const std::optional<std::string>& reason) {
  std::string text;
  for (const std::string& name : quality.figure_names()) {
    const std::vector<double> values = quality.values(name, reason);
    if (!values.empty()) {
      text += fmt::format("{}{} {:.4g}", text.empty() ? "" : ", ", name, Spread::of(values).median);
    }
  }
  return text.empty() ? "no figures" : text;
}

void print_quality(const MapQuality& quality) {
  if (quality.has_report) {
    fmt::print("{:<18} refine {}, cloud of {} points{}\n", "build", quality.build.refine,
               quality.build.cloud_points,
               quality.build.cloud_has_intensity ? "" : " without intensity");
  } else {
    fmt::print(
        "{:<18} no report in the map (an older topoloc-map made it): rejected nodes are not "
        "known\n",
        "build");
  }
  const std::string planned =
      quality.has_report ? fmt::format(" of {} planned", quality.nodes.size()) : "";
  fmt::print("{:<18} {}{} nodes; medians: {}\n", "accepted", quality.accepted(), planned,
             medians(quality, {}));
  for (const auto& [reason, count] : quality.rejected) {
    fmt::print("{:<18} {} {}; medians: {}\n", "rejected", count, reason, medians(quality, reason));
  }
  fmt::print("{:<18} {} of more than {:.0f} m between accepted nodes, along the way\n", "long gaps",
             quality.gaps.size(), mapping::kReportedGap_m);
  for (const mapping::NodeGap& gap : quality.gaps) {
    fmt::print("{:<18} {:.1f} m after node {}, at {:.0f} m of the way, {} rejected nodes in it\n",
               "", gap.length_m, *quality.nodes[gap.after].id, quality.nodes[gap.after].along_m,
               gap.before - gap.after - 1);
  }
}

}  // namespace

void print_inspection(const MapFile& map, const MapSummary& summary, const MapQuality& quality) {
  print_map(map, summary);
  print_quality(quality);
}

}  // namespace topoloc::apps

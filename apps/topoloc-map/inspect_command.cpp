// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/trajectory.hpp"
#include "topoloc/map/map_file.hpp"
#include "topoloc/map/summary.hpp"

#include "commands.hpp"
#include "common/text_file.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>

namespace {

using nlohmann::ordered_json;
using topoloc::map::MapFile;
using topoloc::map::MapInfo;
using topoloc::map::MapSummary;
using topoloc::map::SectionInfo;
using topoloc::map::Spread;

struct Options {
  std::filesystem::path map;
  std::string json;
  std::filesystem::path nodes;
};

/// Text of a 64-bit number: JSON readers lose digits of large ones.
std::string hex(std::uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

ordered_json to_json(const Spread& s) {
  return {{"min", s.min}, {"median", s.median}, {"mean", s.mean}, {"max", s.max}};
}

ordered_json to_json(const MapFile& map, const MapSummary& summary) {
  const MapInfo& info = map.info();
  const topoloc::PinholeCamera& camera = info.camera;
  const Eigen::Quaterniond q = info.T_imu_cam.quaternion();
  ordered_json gaps = ordered_json::array();
  for (const auto& gap : summary.gaps) {
    gaps.push_back({{"after_node", gap.after_node}, {"length_m", gap.length_m}});
  }
  ordered_json sections = ordered_json::array();
  for (const SectionInfo& section : map.sections()) {
    sections.push_back({{"name", section.name},
                        {"version", section.version},
                        {"required", section.required},
                        {"known", section.known},
                        {"offset", section.offset},
                        {"length", section.length},
                        {"checksum", hex(section.checksum)}});
  }
  return {{"file", map.path().string()},
          {"file_size", map.file_size()},
          {"stripped", !map.has_images()},
          {"nodes", summary.node_count},
          {"first_time_ns", summary.first_time_ns},
          {"last_time_ns", summary.last_time_ns},
          {"length_m", summary.length_m},
          {"spacing_m", to_json(summary.spacing_m)},
          {"gaps", gaps},
          {"features", to_json(summary.features)},
          {"lifted_share", to_json(summary.lifted_share)},
          {"depth_std_m", to_json(summary.depth_std_m)},
          {"model",
           {{"name", info.model.name},
            {"fingerprint", hex(info.model.fingerprint)},
            {"descriptor_dim", info.model.descriptor_dim}}},
          {"camera",
           {{"width_px", camera.width_px},
            {"height_px", camera.height_px},
            {"fx_px", camera.fx_px},
            {"fy_px", camera.fy_px},
            {"cx_px", camera.cx_px},
            {"cy_px", camera.cy_px}}},
          {"T_imu_cam",
           {{"p_m", {info.T_imu_cam.p.x(), info.T_imu_cam.p.y(), info.T_imu_cam.p.z()}},
            {"q_xyzw", {q.x(), q.y(), q.z(), q.w()}}}},
          {"origin_m", {info.origin_m.x(), info.origin_m.y(), info.origin_m.z()}},
          {"crs", info.crs},
          {"creator", info.creator},
          {"sections", sections}};
}

void print_spread(const char* name, const Spread& s, int decimals) {
  std::printf("%-18s min %.*f, median %.*f, mean %.*f, max %.*f\n", name, decimals, s.min, decimals,
              s.median, decimals, s.mean, decimals, s.max);
}

void print_table(const MapFile& map, const MapSummary& summary) {
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
  std::printf("%-18s %s\n", "images", map.has_images() ? "yes" : "no (stripped)");
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

/// The poses of the nodes as those of the mapping vehicle's IMU, to compare with a trajectory.
void write_nodes(const std::filesystem::path& file, const MapFile& map) {
  const topoloc::RigidTransform T_cam_imu = map.info().T_imu_cam.inverse();
  topoloc::evaluation::Trajectory trajectory;
  for (std::size_t i = 0; i < map.node_count(); ++i) {
    trajectory.push_back({map.node(i).time_ns, map.T_world_cam(i) * T_cam_imu});
  }
  write_tum(file, trajectory);
}

void run(const Options& options) {
  const MapFile map(options.map);
  const MapSummary summary = summarise(map);
  if (options.json != "-") {
    print_table(map, summary);
  }
  if (!options.json.empty()) {
    topoloc::apps::write_text(options.json, to_json(map, summary).dump(2) + "\n");
  }
  if (!options.nodes.empty()) {
    write_nodes(options.nodes, map);
  }
}

}  // namespace

void add_inspect_command(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  CLI::App* const command = app.add_subcommand("inspect", "Shows what a map holds");
  command->add_option("map", options->map, "Map to show")->required();
  command->add_option("--json", options->json,
                      "Also write the figures as JSON; '-': to stdout, instead of the table");
  command->add_option("--nodes", options->nodes,
                      "Also write the nodes as a TUM trajectory of the mapping IMU (T_world_imu)");
  command->footer(
      "Checks everything but features and images; 'topoloc-map verify' checks those too.\n"
      "Examples:\n"
      "  topoloc-map inspect town.tmap\n"
      "  topoloc-map inspect town.tmap --json - | jq .spacing_m\n"
      "  topoloc-map inspect town.tmap --nodes town-nodes.tum");
  command->callback([options] { run(*options); });
}

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/trajectory.hpp"
#include "topoloc/map/map_file.hpp"
#include "topoloc/map/summary.hpp"

#include "commands.hpp"
#include "common/text_file.hpp"
#include "inspect_drawings.hpp"
#include "inspect_json.hpp"
#include "inspect_table.hpp"
#include "map_quality.hpp"

#include <filesystem>
#include <memory>
#include <string>

namespace {

using topoloc::map::MapFile;
using topoloc::map::MapSummary;

struct Options {
  std::filesystem::path map;
  std::string json;
  std::filesystem::path nodes;
  std::filesystem::path overlay;
  int overlay_every = 0;  ///< 0: about ten, evenly spaced
  std::filesystem::path plots;
};

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
  const topoloc::apps::MapQuality quality = topoloc::apps::read_quality(map);
  if (options.json != "-") {
    topoloc::apps::print_inspection(map, summary, quality);
  }
  if (!options.json.empty()) {
    topoloc::apps::write_text(options.json, topoloc::apps::inspect_json(map, summary, quality));
  }
  if (!options.nodes.empty()) {
    write_nodes(options.nodes, map);
  }
  if (!options.plots.empty()) {
    topoloc::apps::write_plots(options.plots, map, quality);
  }
  // Last: not every map has what it needs, and the rest is there by then.
  if (!options.overlay.empty()) {
    topoloc::apps::write_overlays(options.overlay, map, quality, options.overlay_every);
  }
}

}  // namespace

void add_inspect_command(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  CLI::App* const command =
      app.add_subcommand("inspect", "Shows what a map holds and how good its nodes are");
  command->add_option("map", options->map, "Map to show")->required();
  command->add_option("--json", options->json,
                      "Also write everything as JSON, node by node; '-': to stdout, instead of the "
                      "table");
  command->add_option("--nodes", options->nodes,
                      "Also write the nodes as a TUM trajectory of the mapping IMU (T_world_imu)");
  auto* const overlay = command->add_option(
      "--overlay", options->overlay,
      "Also draw the LiDAR over the camera image of some nodes: PNGs in this folder");
  command
      ->add_option("--overlay-every", options->overlay_every,
                   "Draw every Nth node [about ten, evenly spaced]")
      ->check(CLI::Range(1, 1 << 24))
      ->needs(overlay);
  command->add_option("--plots", options->plots,
                      "Also draw the map from above (map.png) and the nodes' figures along the way "
                      "(figures.png) in this folder");
  command->footer(
      "Needs the map alone, no drive and no cloud. A stripped map has nothing to draw overlays "
      "from.\n"
      "Checks everything but features and images; 'topoloc-map verify' checks those too.\n"
      "Examples:\n"
      "  topoloc-map inspect town.tmap\n"
      "  topoloc-map inspect town.tmap --overlay look --overlay-every 20 --plots look\n"
      "  topoloc-map inspect town.tmap --json - | jq .build.rejected\n"
      "  topoloc-map inspect town.tmap --nodes town-nodes.tum");
  command->callback([options] { run(*options); });
}

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/map/maintenance.hpp"

#include "commands.hpp"

#include <filesystem>
#include <iostream>
#include <memory>

namespace {

struct Options {
  std::filesystem::path in;
  std::filesystem::path out;
};

void run(const Options& options) {
  const auto before = std::filesystem::exists(options.in) ? file_size(options.in) : 0;
  topoloc::map::strip(options.in, options.out);
  std::cout << options.out.string() << ": " << before << " -> "
            << std::filesystem::file_size(options.out) << " bytes\n";
}

}  // namespace

void add_strip_command(CLI::App& app) {
  const auto options = std::make_shared<Options>();
  CLI::App* const command = app.add_subcommand(
      "strip", "Removes the images of camera, depth and LiDAR, which driving needs not");
  command->add_option("map", options->in, "Map to read")->required();
  command->add_option("--out,-o", options->out, "Map to write; may be the map itself")->required();
  command->footer(
      "Everything else stays as it is, byte for byte. The new file appears complete or not at "
      "all.\n"
      "Examples:\n"
      "  topoloc-map strip town.tmap --out town-vehicle.tmap\n"
      "  topoloc-map strip town.tmap --out town.tmap");
  command->callback([options] { run(*options); });
}

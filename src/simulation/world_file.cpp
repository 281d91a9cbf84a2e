// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/world_file.hpp"

#include "config/strict_node.hpp"

#include <charconv>
#include <fstream>
#include <stdexcept>
#include <string>

#include <fmt/core.h>

namespace topoloc::simulation {

void write_world_file(const std::filesystem::path& file, const world::WorldSpec& spec) {
  std::ofstream stream(file);
  stream << fmt::format(
      "# The world of this drive; topoloc-simulate --from-world makes another day's drive in it.\n"
      "format: 1\n"
      "world_version: {}\n"
      "scenario: {}\n"
      "seed: {}\n"
      "length_m: {}\n",
      kWorldVersion, world::name(spec.scenario), spec.seed, spec.length_m);
  stream.close();
  if (!stream) {
    throw std::runtime_error(file.string() + ": cannot write");
  }
}

world::WorldSpec read_world_file(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) {
    throw std::runtime_error(file.string() +
                             ": no such file; a folder that topoloc-simulate made has it");
  }
  config::StrictNode node = config::StrictNode::load(file);
  int format = 0;
  node.require("format", format, config::Range{1, 1});
  int version = 0;
  node.require("world_version", version, config::Range{1, 1e6});
  if (version != kWorldVersion) {
    throw node.error("world_version",
                     fmt::format("this program makes worlds of version {}, the drive's is of {}: "
                                 "simulate the mapping drive anew",
                                 kWorldVersion, version));
  }
  world::WorldSpec spec;
  std::string scenario;
  node.require("scenario", scenario);
  try {
    spec.scenario = world::scenario_of(scenario);
  } catch (const std::invalid_argument& error) {
    throw node.error("scenario", error.what());
  }
  std::string seed;
  node.require("seed", seed);
  const auto [end, error] = std::from_chars(seed.data(), seed.data() + seed.size(), spec.seed);
  if (error != std::errc{} || end != seed.data() + seed.size()) {
    throw node.error("seed", "expected a whole number, found '" + seed + "'");
  }
  node.require("length_m", spec.length_m, config::Range{1.0, 1e6});
  node.finish();
  return spec;
}

}  // namespace topoloc::simulation

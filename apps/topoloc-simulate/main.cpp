// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/drive_folder.hpp"
#include "topoloc/simulation/simulate.hpp"
#include "topoloc/simulation/world_file.hpp"

#include "common/progress_bar.hpp"
#include "common/run_app.hpp"
#include "common/stop_request.hpp"
#include "common/text_file.hpp"
#include "option_checks.hpp"
#include "summary.hpp"

#include <cmath>
#include <filesystem>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>

namespace {

namespace fs = std::filesystem;
namespace simulation = topoloc::simulation;

constexpr const char* kExamples = R"(
Examples:
  topoloc-simulate --scenario town --seed 7 --out drives/town
  topoloc-simulate --from-world drives/town --light dusk --seed 8 --out drives/town_dusk
  topoloc-simulate --scenario mixed --length-km 0.3 --out drives/short --json -
  topoloc-simulate --scenario tunnel --seed 3 --no-images --ideal-sensors --out drives/ideal
  topoloc-simulate --scenario town --length-km 5 --no-images --no-cloud --out drives/inertial

The first makes a world and a mapping drive in it: images, IMU and wheels, LiDAR cloud (cloud.laz),
rough and true trajectory. With --from-world: another day's drive in the same world, with other
light, traffic and parked cars, without cloud. What is in the folder: docs/simulation.md.
Exit code: 0 done, 1 failed, 2 wrong usage.)";

struct Options {
  std::string scenario;
  std::uint64_t seed = 1;
  fs::path out;
  double length_km = 1.0;
  std::string light = "day";
  fs::path from_world;
  bool force = false;
  double camera_hz = 10.0;
  int image_width_px = 720;
  bool ply = false;
  double readout_ms = 0.0;
  bool no_images = false;
  bool no_cloud = false;
  bool ideal_sensors = false;
  bool slip = false;
  std::string json;
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("--scenario", options.scenario, "What the road leads through")
      ->check(CLI::IsMember({"town", "highway", "tunnel", "mixed"}));
  app.add_option("--seed", options.seed,
                 "Of the world and the drive; with --from-world of the drive only")
      ->transform(whole_number())
      ->capture_default_str();
  app.add_option("--out", options.out, "Drive folder to make")->required();
  app.add_option("--length-km", options.length_km, "Of the road")
      ->check(number_within(0.05, 50.0))
      ->capture_default_str();
  app.add_option("--light", options.light)
      ->check(CLI::IsMember({"day", "overcast", "dusk", "night"}))
      ->capture_default_str();
  app.add_option("--from-world", options.from_world,
                 "Drive folder whose world is driven in once more, on another day");
  app.add_flag("--force", options.force, "Replace an existing drive folder");
  app.add_option("--camera-hz", options.camera_hz, "Images a second")
      ->check(number_within(0.1, 60.0))
      ->capture_default_str();
  app.add_option("--image-width", options.image_width_px,
                 "Of the camera's images in px; the height is 5/8 of it")
      ->check(CLI::Range(64, 4096))
      ->capture_default_str();
  auto* ply = app.add_flag("--ply", options.ply, "The cloud as cloud.ply, too");
  app.add_option("--readout-ms", options.readout_ms,
                 "Rolling shutter: from the first row to the last; 0: global")
      ->check(number_within(0.0, 100.0))
      ->capture_default_str();
  app.add_flag("--no-images", options.no_images, "No camera.lcm: done in seconds");
  app.add_flag("--no-cloud", options.no_cloud, "No cloud.laz of a mapping drive")->excludes(ply);
  app.add_flag("--ideal-sensors", options.ideal_sensors,
               "No noise, biases, delays or mounting errors; points exactly on their surfaces");
  app.add_flag("--slip", options.slip, "Wheels that spin and lock now and then");
  app.add_option("--json", options.json, "The summary as JSON to this file, - for stdout");
}

topoloc::world::WorldSpec world_of(const CLI::App& app, const Options& options) {
  if (!options.from_world.empty()) {
    const auto world = simulation::read_world_file(options.from_world / "world.yaml");
    const std::string scenario(topoloc::world::name(world.scenario));
    if (app.count("--scenario") > 0 && options.scenario != scenario) {
      throw CLI::ValidationError("--scenario", "the world of " + options.from_world.string() +
                                                   " is '" + scenario + "', not '" +
                                                   options.scenario + "'");
    }
    if (app.count("--length-km") > 0 &&
        std::abs(options.length_km * 1000.0 - world.length_m) > 1e-6) {
      throw CLI::ValidationError("--length-km",
                                 "the world of " + options.from_world.string() + " is " +
                                     std::to_string(world.length_m / 1000.0) + " km long");
    }
    return world;
  }
  if (options.scenario.empty()) {
    throw CLI::RequiredError("--scenario or --from-world");
  }
  return {.scenario = topoloc::world::scenario_of(options.scenario),
          .seed = options.seed,
          .length_m = options.length_km * 1000.0};
}

bool in_folder(const fs::path& file, const fs::path& folder) {
  const auto parent = [](const fs::path& path) {
    return fs::absolute(path).lexically_normal().parent_path();
  };
  return parent(file) == parent(folder / "any");
}

int simulate(const CLI::App& app, const Options& options) {
  simulation::DriveRequest request;
  request.world = world_of(app, options);
  request.mapping = options.from_world.empty();
  request.seed = options.seed;
  request.light = topoloc::rendering::light_of(options.light);
  request.images = !options.no_images;
  request.cloud = !options.no_cloud;
  request.ply = options.ply;
  request.ideal_sensors = options.ideal_sensors;
  request.slip = options.slip;
  request.camera_hz = options.camera_hz;
  request.image_width_px = options.image_width_px;
  request.readout_s = 1e-3 * options.readout_ms;
  if (request.camera_hz * request.readout_s > 1.0) {
    throw CLI::ValidationError("--readout-ms", "is longer than the time between images");
  }
  if (options.ply && !request.mapping) {
    throw CLI::ValidationError("--ply", "only a mapping drive, without --from-world, has a cloud");
  }
  if (!request.mapping && fs::exists(options.out) &&
      fs::equivalent(options.out, options.from_world)) {
    throw CLI::ValidationError("--out", "is the folder of --from-world");
  }

  // What would stop it after all the work stops it before; a drive's own folder is yet to be made.
  const bool to_file = !options.json.empty() && options.json != "-";
  const bool in_drive = to_file && in_folder(options.json, options.out);
  if (to_file && !in_drive) {
    topoloc::apps::require_writable(options.json);
  }

  topoloc::apps::stop_on_signals();
  std::string stage_shown;
  std::optional<topoloc::apps::ProgressBar> bar;
  const auto progress = [&](const std::string& stage, double share) {
    if (topoloc::apps::stop_requested) {
      throw std::runtime_error("stopped; nothing is left of the drive");
    }
    if (stage != stage_shown) {
      stage_shown = stage;
      bar.emplace(stage);
    }
    bar->update(share);
  };
  simulation::DriveSummary summary;
  simulation::create_folder(options.out, options.force, [&](const fs::path& folder) {
    summary = simulation::simulate_drive(request, folder, progress);
    if (to_file) {
      const fs::path file = options.json;
      topoloc::apps::write_text(in_drive ? folder / file.filename() : file,
                                to_json(request, summary));
    }
  });
  std::cout << (options.json == "-" ? to_json(request, summary) : to_text(summary));
  return topoloc::apps::kDone;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Drives through a made-up world, as drive folders with ground truth.");
  app.set_version_flag("--version", TOPOLOC_VERSION);
  app.footer(kExamples);
  add_options(app, options);
  return topoloc::apps::run_app(app, "topoloc-simulate", argc, argv,
                                [&] { return simulate(app, options); });
}

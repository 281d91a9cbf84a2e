// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/localiser/batch.hpp"
#include "topoloc/localiser/result_files.hpp"

#include "common/initial_pose.hpp"
#include "common/log_damage.hpp"
#include "common/progress_bar.hpp"
#include "common/text_file.hpp"
#include "summary.hpp"

#include <exception>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

namespace {

namespace localiser = topoloc::localiser;

constexpr const char* kExamples = R"(
Examples:
  topoloc-localise --drive drives/monday --map town.tmap --out monday.tum
  topoloc-localise --drive drives/monday --map town.tmap --out monday.tum \
      --initial-pose "12.1 -3.4 0.2 0 0 0.7071 0.7071"
  topoloc-localise --drive drives/monday --dead-reckoning --out reckoned.tum

Writes EST.tum (T_world_imu at every tick), EST.states.csv (full state and covariance) and
EST.updates.csv (one line per camera frame). Exit code: 0 done, 1 failed, 2 wrong usage.)";

struct Options {
  std::filesystem::path drive;
  std::filesystem::path vehicle;
  std::filesystem::path map;
  std::filesystem::path out;
  std::string frames = "all";
  std::string initial_pose;
  double start_s = 0.0;
  bool no_speed = false;
  bool dead_reckoning = false;
  double match_delay_s = 0.0;
  std::string json;
};

void print_summary(const Options& options, const nlohmann::json& figures,
                   const topoloc::drive::Drive& drive, const topoloc::drive::FrameLog* frames) {
  fmt::print(
      "{}: {} poses, {} frames, {} map updates accepted, {} rejected, {:.0f} inliers and "
      "{:.1f} ms a frame (medians)\n",
      options.out.string(), figures["ticks"].get<std::uint64_t>(),
      figures["frames"].get<std::uint64_t>(), figures["map_updates_accepted"].get<std::uint64_t>(),
      figures["map_updates_rejected"].get<std::uint64_t>(), figures["median_inliers"].get<double>(),
      figures["median_frame_ms"].get<double>());
  for (const auto& [verdict, count] : figures["verdicts"].items()) {
    if (verdict != "ok" && verdict != "update_accepted") {
      fmt::print("  frames {}: {}\n", verdict, count.get<int>());
    }
  }
  if (frames != nullptr && figures["map_updates_accepted"].get<std::uint64_t>() == 0) {
    fmt::print(stderr,
               "topoloc-localise: warning: the map was never used, this is dead reckoning; is it "
               "the map of this place, and the initial pose in its frame?\n");
  }
  for (const auto& [why, count] : figures["rejected"].items()) {
    fmt::print("  rejected {}: {}\n", why, count.get<std::uint64_t>());
  }
  if (drive.lost_messages > 0) {
    fmt::print("CAN messages missing in the log, by their counters: {}\n", drive.lost_messages);
  }
  if (!drive.first_malformed_line.empty()) {
    fmt::print("first malformed line: {}\n", drive.first_malformed_line);
  }
  if (frames != nullptr) {
    if (!frames->first_error().empty()) {
      fmt::print("first rejected frame: {}\n", frames->first_error());
    }
    fmt::print("{}", topoloc::apps::to_text(frames->damage()));
  }
}

void run(const Options& options) {
  localiser::BatchOptions batch;
  batch.frames = topoloc::drive::parse_frame_selection(options.frames);
  batch.start_s = options.start_s;
  batch.use_speed = !options.no_speed;
  batch.match_delay_s = options.match_delay_s;
  if (!options.initial_pose.empty()) {
    batch.initial_pose = topoloc::apps::parse_initial_pose(options.initial_pose);
  }
  const topoloc::drive::Drive drive = topoloc::drive::load_drive(options.drive, options.vehicle);
  std::optional<topoloc::drive::FrameLog> frames;
  std::optional<topoloc::map::MapFile> map;
  if (!options.dead_reckoning) {
    frames.emplace(topoloc::drive::open_frames(drive));
    map.emplace(options.map);
  }
  topoloc::drive::FrameLog* const log = frames ? &*frames : nullptr;
  localiser::ResultFiles files(options.out);
  localiser::BatchResult result;
  {
    topoloc::apps::ProgressBar bar("localising");
    result = localiser::run_batch(
        drive, log, map ? &*map : nullptr, batch,
        {.estimate = [&files](const topoloc::estimation::Estimate& e) { files.add(e); },
         .progress = [&bar](double share) { bar.update(share); }});
  }
  if (result.estimates == 0) {
    throw std::runtime_error(options.drive.string() + ": the filter never started");
  }
  files.finish(result.frames);

  const nlohmann::json figures = summary(drive, log, result);
  if (!options.json.empty()) {
    topoloc::apps::write_text(options.json, figures.dump(2) + "\n");
  }
  if (options.json != "-") {
    print_summary(options, figures, drive, log);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Localises a vehicle on a topological map from camera, IMU and wheel speed."};
  app.footer(kExamples);
  app.set_version_flag("--version", TOPOLOC_VERSION);
  Options options;
  app.add_option("--drive", options.drive, "Drive folder (docs/drive-folder.md)")->required();
  app.add_option("--vehicle", options.vehicle, "Instead of the drive's vehicle.yaml");
  auto* map = app.add_option("--map", options.map, "Map made by topoloc-map build");
  app.add_option("--out", options.out, "Trajectory to write (TUM)")->required();
  app.add_option("--frames", options.frames, "Frames to use, by their place in the log")
      ->check(CLI::IsMember({"all", "even", "odd"}))
      ->capture_default_str();
  app.add_option("--initial-pose", options.initial_pose,
                 "T_world_imu at the start, \"x y z qx qy qz qw\"; default: from the "
                 "drive's ground_truth.tum");
  app.add_option("--start-seconds", options.start_s,
                 "Start so long after the drive's first inertial sample")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  app.add_flag("--no-speed", options.no_speed, "Do not use wheel speed");
  app.add_option("--match-delay", options.match_delay_s,
                 "Seconds by which matches reach the filter late")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  app.add_option("--json", options.json, "Write the summary as JSON to this file, - for stdout");
  auto* reckoning =
      app.add_flag("--dead-reckoning", options.dead_reckoning, "IMU and wheel speed only, no map")
          ->excludes(map);
  try {
    app.parse(argc, argv);
    if (map->count() == 0 && reckoning->count() == 0) {
      throw CLI::RequiredError("--map (or --dead-reckoning)");
    }
    run(options);
    return 0;
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::Error& e) {
    app.exit(e);
    return 2;
  } catch (const std::exception& e) {
    fmt::print(stderr, "topoloc-localise: {}\n", e.what());
    return 1;
  }
}

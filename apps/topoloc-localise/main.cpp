// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "commands.hpp"
#include "common/run_app.hpp"

#include <CLI/CLI.hpp>

namespace {

using topoloc::apps::Options;

constexpr const char* kExamples = R"(
Examples:
  topoloc-localise --config vehicle.yaml --map town.tmap       (the vehicle process)
  topoloc-localise --config vehicle.yaml --map town.tmap --can can0=vcan0 --journal /var/tmp/flight
  topoloc-localise --config vehicle.yaml --map town.tmap --check
  topoloc-localise --config vehicle.yaml --replay /var/tmp/flight --out replayed.tum
  topoloc-localise --drive drives/monday --map town.tmap --out monday.tum
  topoloc-localise --drive drives/monday --map town.tmap --out monday.tum \
      --initial-pose "12.1 -3.4 0.2 0 0 0.7071 0.7071"
  topoloc-localise --drive drives/monday --dead-reckoning --out reckoned.tum

With --drive or --replay it writes EST.tum (T_world_imu at every tick), EST.states.csv (full state
and covariance) and EST.updates.csv (one line per camera frame); with --replay also EST.lcm (the
estimates as they were published). With --config it runs until SIGTERM, SIGINT or a stop command on
LCM; docs/deployment.md. Exit code: 0 done, 1 failed, 2 wrong usage, 3 stopped while the
disk did not answer (the end of the journal or the last pose is not written).)";

void add_options(CLI::App& app, Options& options) {
  auto* drive = app.add_option("--drive", options.drive, "Drive folder (docs/drive-folder.md)");
  auto* config = app.add_option("--config", options.config,
                                "vehicle.yaml of this vehicle: run live, on CAN and LCM");
  auto* replay = app.add_option("--replay", options.replay, "Folder of a live run's journal");
  auto* map = app.add_option("--map", options.map, "Map made by topoloc-map build");
  auto* reckoning =
      app.add_flag("--dead-reckoning", options.dead_reckoning, "IMU and wheel speed only, no map");
  auto* out = app.add_option("--out", options.out, "Trajectory to write (TUM)");
  drive->excludes(config)->excludes(replay)->needs(out);
  replay->needs(config)->needs(out)->excludes(map);
  reckoning->excludes(map);
  app.add_option("--initial-pose", options.initial_pose,
                 "T_world_imu at the start, \"x y z qx qy qz qw\"; default: from the drive's "
                 "ground_truth.tum, live the last pose kept; of a journal its own");

  constexpr const char* kDrive = "Of a recorded drive";
  const auto of_drive = [&](CLI::Option* option) { option->group(kDrive)->needs(drive); };
  of_drive(app.add_option("--vehicle", options.vehicle, "Instead of the drive's vehicle.yaml"));
  of_drive(app.add_option("--frames", options.frames, "Frames to use, by their place in the log")
               ->check(CLI::IsMember({"all", "even", "odd"}))
               ->capture_default_str());
  of_drive(app.add_option("--start-seconds", options.start_s,
                          "Start so long after the drive's first inertial sample")
               ->check(CLI::Range(0.0, 1e6))
               ->capture_default_str());
  of_drive(app.add_flag("--no-speed", options.no_speed, "Do not use wheel speed"));
  of_drive(app.add_option("--match-delay", options.match_delay_s,
                          "Seconds by which matches reach the filter late")
               ->check(CLI::Range(0.0, 10.0))
               ->capture_default_str());
  of_drive(app.add_option("--match-effort", options.match_effort,
                          "0 as configured, 1 guided, 2 guided with half of the rows: "
                          "what a vehicle short of time falls back to")
               ->check(CLI::Range(0, 2))
               ->capture_default_str());
  of_drive(app.add_option("--match-seconds", options.match_seconds,
                          "Seconds that a slow matcher takes for a frame, leaving out those that "
                          "come meanwhile")
               ->check(CLI::Range(0.0, 10.0))
               ->capture_default_str());
  app.add_option("--json", options.json,
                 "With --drive or --check: the summary as JSON to this file, - for stdout");

  constexpr const char* kLive = "Of the vehicle process";
  const auto live = [&](CLI::Option* option) { option->group(kLive)->needs(config); };
  live(app.add_option("--can", options.can,
                      "CAN interfaces instead of the configuration's; can0=vcan0: vcan0 where it "
                      "says can0")
           ->take_all());
  live(app.add_flag("--check", options.check,
                    "Try all that the process needs (configuration, DBC, map, models, interfaces, "
                    "buffers, privileges), say what is missing, and exit")
           ->excludes(replay));
  live(app.add_option("--lcm", options.lcm_url, "LCM address instead of the configuration's"));
  live(app.add_option("--journal", options.journal,
                      "Folder for the flight recorder, instead of the configuration's"));
  live(app.add_option("--last-pose", options.last_pose,
                      "File that keeps the last pose, instead of the configuration's"));
}

void check_usage(const Options& options) {
  if (options.drive.empty() && options.config.empty()) {
    throw CLI::RequiredError("--drive, or --config,");
  }
  if (options.replay.empty() && options.map.empty() && !options.dead_reckoning) {
    throw CLI::RequiredError("--map (or --dead-reckoning)");
  }
  if (!options.out.empty() && options.drive.empty() && options.replay.empty()) {
    throw CLI::RequiresError("--out", "--drive or --replay");
  }
}

int run(const Options& options) {
  if (!options.drive.empty()) {
    topoloc::apps::localise_drive(options);
    return 0;
  }
  if (!options.replay.empty()) {
    topoloc::apps::replay_journal(options);
    return 0;
  }
  return options.check ? topoloc::apps::check_vehicle(options)
                       : topoloc::apps::localise_live(options);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Localises a vehicle on a topological map from camera, IMU and wheel speed."};
  app.footer(kExamples);
  app.set_version_flag("--version", TOPOLOC_VERSION);
  Options options;
  add_options(app, options);
  return topoloc::apps::run_app(app, "topoloc-localise", argc, argv, [&] {
    check_usage(options);
    return run(options);
  });
}

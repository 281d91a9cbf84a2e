// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/localiser/batch.hpp"
#include "topoloc/localiser/result_files.hpp"

#include "common/progress_bar.hpp"

#include <cmath>
#include <exception>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

namespace {

using topoloc::RigidTransform;
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

RigidTransform parse_pose(const std::string& text) {
  std::istringstream in(text);
  Eigen::Vector3d p;
  Eigen::Quaterniond q;
  std::string rest;
  const bool read =
      static_cast<bool>(in >> p.x() >> p.y() >> p.z() >> q.x() >> q.y() >> q.z() >> q.w());
  if (!read || (in >> rest) || !p.allFinite() || !q.coeffs().allFinite() ||
      std::abs(q.norm() - 1.0) > 0.01) {
    throw CLI::ValidationError("--initial-pose",
                               "expected \"x y z qx qy qz qw\" with a unit "
                               "quaternion, found \"" +
                                   text + "\"");
  }
  return RigidTransform::from_quaternion(p, q);
}

double median(std::vector<double> values) {
  if (values.empty()) {
    return 0.0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

nlohmann::json summary(const topoloc::drive::Drive& drive, const localiser::BatchResult& result) {
  std::vector<double> inliers;
  std::vector<double> frame_ms;
  std::map<std::string, int> verdicts;
  for (const auto& frame : result.frames) {
    const auto& t = frame.matching.times;
    frame_ms.push_back(t.undistort_ms + t.extract_ms + t.select_ms + t.match_ms + t.outliers_ms);
    ++verdicts[std::string(topoloc::matching::to_string(frame.matching.verdict))];
    if (frame.update) {
      inliers.push_back(frame.update->result.inliers);
      ++verdicts[fmt::format("update_{}", topoloc::estimation::name(frame.update->result.verdict))];
    }
  }
  const auto& c = result.counters;
  nlohmann::json rejected(drive.rejected);
  for (int i = 1; i < topoloc::estimation::kInsertVerdictCount; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const std::string why =
        topoloc::estimation::name(static_cast<topoloc::estimation::InsertVerdict>(i));
    const auto note = [&](const char* sensor, std::uint64_t count) {
      if (count > 0) {
        rejected[fmt::format("{}_{}", sensor, why)] = count;
      }
    };
    note("imu", c.imu[k]);
    note("speed", c.speed[k]);
    note("matches", c.matches[k]);
  }
  if (c.speed_gate_rejected > 0) {
    rejected["speed_innovation_too_large"] = c.speed_gate_rejected;
  }
  if (c.speed_unused > 0) {
    rejected["speed_unused"] = c.speed_unused;
  }
  if (result.frames_undecodable > 0) {
    rejected["frame_undecodable"] = result.frames_undecodable;
  }
  if (result.frames_before_start > 0) {
    rejected["frame_before_start"] = result.frames_before_start;
  }
  return {{"ticks", result.estimates.size()},
          {"frames", result.frames.size()},
          {"map_updates_accepted", c.map_accepted},
          {"map_updates_rejected", c.map_rejected},
          {"doubts", c.doubts},
          {"imu_gaps", c.imu_gaps},
          {"median_inliers", median(inliers)},
          {"median_frame_ms", median(frame_ms)},
          {"verdicts", verdicts},
          {"rejected", rejected}};
}

void run(const Options& options) {
  localiser::BatchOptions batch;
  batch.frames = localiser::parse_frame_selection(options.frames);
  batch.start_s = options.start_s;
  batch.use_speed = !options.no_speed;
  batch.match_delay_s = options.match_delay_s;
  if (!options.initial_pose.empty()) {
    batch.initial_pose = parse_pose(options.initial_pose);
  }
  const topoloc::drive::Drive drive = topoloc::drive::load_drive(options.drive, options.vehicle);
  std::optional<topoloc::drive::FrameLog> frames;
  std::optional<topoloc::map::MapFile> map;
  if (!options.dead_reckoning) {
    frames.emplace(topoloc::drive::open_frames(drive));
    map.emplace(options.map);
  }
  localiser::BatchResult result;
  {
    topoloc::apps::ProgressBar bar("localising");
    result = localiser::run_batch(drive, frames ? &*frames : nullptr, map ? &*map : nullptr, batch,
                                  [&bar](double share) { bar.update(share); });
  }
  if (result.estimates.empty()) {
    throw std::runtime_error(options.drive.string() + ": the filter never started");
  }
  localiser::write_trajectory(options.out, result);
  localiser::write_states(localiser::states_path(options.out), result);
  localiser::write_updates(localiser::updates_path(options.out), result);

  const nlohmann::json figures = summary(drive, result);
  if (options.json == "-") {
    fmt::print("{}\n", figures.dump(2));
    return;
  }
  if (!options.json.empty()) {
    std::ofstream(options.json) << figures.dump(2) << "\n";
  }
  fmt::print(
      "{}: {} poses, {} frames, {} map updates accepted, {} rejected, {:.0f} inliers and "
      "{:.1f} ms a frame (medians)\n",
      options.out.string(), result.estimates.size(), result.frames.size(),
      result.counters.map_accepted, result.counters.map_rejected,
      figures["median_inliers"].get<double>(), figures["median_frame_ms"].get<double>());
  for (const auto& [why, count] : figures["rejected"].items()) {
    fmt::print("  rejected {}: {}\n", why, count.get<std::uint64_t>());
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
      app.add_flag("--dead-reckoning", options.dead_reckoning, "IMU and wheel speed only, no map");
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

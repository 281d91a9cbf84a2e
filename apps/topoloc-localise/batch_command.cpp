// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/localiser/batch.hpp"
#include "topoloc/localiser/result_files.hpp"

#include "commands.hpp"
#include "common/initial_pose.hpp"
#include "common/log_damage.hpp"
#include "common/progress_bar.hpp"
#include "common/text_file.hpp"
#include "summary.hpp"

#include <optional>
#include <stdexcept>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

namespace topoloc::apps {
namespace {

void print_summary(const Options& options, const nlohmann::json& figures, const drive::Drive& drive,
                   const drive::FrameLog* frames) {
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
    fmt::print("{}", to_text(frames->damage()));
  }
}

}  // namespace

void localise_drive(const Options& options) {
  localiser::BatchOptions batch;
  batch.frames = drive::parse_frame_selection(options.frames);
  batch.start_s = options.start_s;
  batch.use_speed = !options.no_speed;
  batch.match_delay_s = options.match_delay_s;
  batch.effort = static_cast<matching::Effort>(options.match_effort);
  batch.match_seconds = options.match_seconds;
  if (!options.initial_pose.empty()) {
    batch.initial_pose = parse_initial_pose(options.initial_pose);
  }
  const drive::Drive drive = drive::load_drive(options.drive, options.vehicle);
  std::optional<drive::FrameLog> frames;
  std::optional<map::MapFile> map;
  if (!options.dead_reckoning) {
    frames.emplace(drive::open_frames(drive));
    map.emplace(options.map);
  }
  drive::FrameLog* const log = frames ? &*frames : nullptr;
  localiser::ResultFiles files(options.out);
  localiser::BatchResult result;
  {
    ProgressBar bar("localising");
    result =
        localiser::run_batch(drive, log, map ? &*map : nullptr, batch,
                             {.estimate = [&files](const estimation::Estimate& e) { files.add(e); },
                              .progress = [&bar](double share) { bar.update(share); }});
  }
  if (result.estimates == 0) {
    throw std::runtime_error(options.drive.string() + ": the filter never started");
  }
  files.finish(result.frames);

  const nlohmann::json figures = summary(drive, log, result);
  if (!options.json.empty()) {
    write_text(options.json, figures.dump(2) + "\n");
  }
  if (options.json != "-") {
    print_summary(options, figures, drive, log);
  }
}

}  // namespace topoloc::apps

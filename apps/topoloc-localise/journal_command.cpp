// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/config/vehicle_config.hpp"
#include "topoloc/live/journal_replay.hpp"
#include "topoloc/live/messages.hpp"
#include "topoloc/localiser/result_files.hpp"
#include "topoloc/transport/lcm_log.hpp"

#include "commands.hpp"
#include "common/initial_pose.hpp"
#include "common/text_file.hpp"

#include <cstddef>
#include <optional>
#include <vector>

#include <fmt/core.h>

namespace topoloc::apps {
namespace {

/// An LCM event log with what a live process publishes on its estimate channel.
class EstimateLog {
 public:
  EstimateLog(const std::filesystem::path& file, std::string channel)
      : log_(file), channel_(std::move(channel)) {}

  void add(const live::TickOutput& output) {
    const estimate_t message = live::to_estimate(output);
    encoded_.resize(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(encoded_.data(), 0, static_cast<int>(encoded_.size()));
    log_.write(message.utime, channel_, encoded_);
  }
  void close() { log_.close(); }

 private:
  transport::LcmLogWriter log_;
  std::string channel_;
  std::vector<std::byte> encoded_;
};

void warn(const std::string& text) { fmt::print(stderr, "topoloc-localise: warning: {}\n", text); }

void tell(const Options& options, const live::ReplaySummary& replay) {
  const live::JournalSummary& summary = replay.journal;
  if (summary.other_version) {
    warn(
        "this replay is not exact: the journal was written by another version of topoloc, and "
        "this one cannot read all of it");
  }
  const bool has_start = !summary.vehicle_yaml.empty();  // else nothing is known of the run
  if (has_start && summary.vehicle_yaml != read_text(options.config)) {
    warn(options.config.string() + ": is not what the journal was recorded with");
  }
  if (has_start && summary.with_map == options.dead_reckoning) {
    warn(summary.with_map ? "the journal is of a run with a map: leave out --dead-reckoning"
                          : "the journal is of a run without a map: give --dead-reckoning");
  }
  if (!summary.from_start && !summary.other_version) {
    warn(
        fmt::format("the journal begins in the middle of a run: {} ticks before the filter had a "
                    "pose were left out",
                    replay.left_out));
  }
  if (replay.pose_given) {
    warn(replay.started_from_given
             ? "this replay is not exact: the filter was started from --initial-pose"
             : "this replay is not exact: the filter could not be started from --initial-pose, for "
               "want of inertial data and a wheel speed");
  }
  if (replay.started > (replay.started_from_given ? 1U : 0U)) {
    warn(
        "this replay is not exact: the filter was started from the pose that a file of the "
        "journal begins with, and knew less than the one that was recorded");
  } else if (!summary.from_start && !summary.other_version && !replay.pose_given) {
    warn("this replay is not exact: what the filter knew before is not in the journal");
  }
  if (summary.lost_ticks + summary.lost_match_sets + summary.unreadable + summary.missing_files >
      0) {
    warn(fmt::format(
        "the journal has gaps ({} ticks and {} match sets lost, {} places "
        "unreadable, {} files missing): the rest may differ from what was published",
        summary.lost_ticks, summary.lost_match_sets, summary.unreadable, summary.missing_files));
  }
}

}  // namespace

void replay_journal(const Options& options) {
  const config::VehicleConfig vehicle = config::load_vehicle_config(options.config);
  std::optional<RigidTransform> initial_pose;
  if (!options.initial_pose.empty()) {
    initial_pose = parse_initial_pose(options.initial_pose);
  }
  localiser::ResultFiles files(options.out);
  std::filesystem::path log_file = options.out;
  log_file.replace_extension(".lcm");
  // A vehicle that does not publish its estimates has a journal of them all the same.
  const std::string& channel = vehicle.live.channels.estimate;
  EstimateLog log(log_file, channel.empty() ? config::LcmChannels{}.estimate : channel);
  const live::ReplaySummary summary = live::replay_journal(
      options.replay,
      options.dead_reckoning ? estimation::without_map(vehicle.estimator) : vehicle.estimator,
      initial_pose, [&](const live::TickOutput& output) {
        log.add(output);
        if (live::has_pose(output)) {
          files.add(output.estimate);
        }
      });
  log.close();
  files.finish({});
  tell(options, summary);
  fmt::print("{}: {} ticks replayed{}; estimates {} in {}\n", options.out.string(), summary.ticks,
             summary.is_exact() ? ", exactly" : "",
             summary.is_exact() ? "as published" : "of this replay", log_file.string());
}

}  // namespace topoloc::apps

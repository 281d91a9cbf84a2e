// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "summary.hpp"

#include "topoloc/evaluation/median.hpp"

#include "common/log_damage.hpp"

#include <map>
#include <string>
#include <vector>

#include <fmt/core.h>

namespace {

using topoloc::drive::Drive;
using topoloc::drive::FrameLog;
using topoloc::evaluation::median;
using topoloc::localiser::BatchResult;

/// Counts by reason; reasons that did not occur are left out.
using Counts = std::map<std::string, std::uint64_t>;

Counts rejected(const Drive& drive, const FrameLog* frames, const BatchResult& result) {
  using topoloc::estimation::InsertVerdict;
  Counts counts = drive.rejected;
  if (frames != nullptr) {
    counts.merge(frames->rejected());
  }
  const auto note = [&counts](const std::string& reason, std::uint64_t count) {
    if (count > 0) {
      counts[reason] = count;
    }
  };
  const topoloc::estimation::Counters& c = result.counters;
  for (int i = 1; i < topoloc::estimation::kInsertVerdictCount; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const std::string why = topoloc::estimation::name(static_cast<InsertVerdict>(i));
    note("imu_" + why, c.imu[k]);
    note("speed_" + why, c.speed[k]);
    note("matches_" + why, c.matches[k]);
  }
  note("initial_pose", c.initial_pose_rejected);
  note("forgotten_at_restart", c.forgotten);
  note("speed_innovation_too_large", c.speed_gate_rejected);
  note("speed_unused", c.speed_unused);
  note("frame_before_start", result.frames_before_start);
  note("frame_skipped", result.frames_skipped);
  std::uint64_t damaged_nodes = 0;
  std::uint64_t over_capacity = 0;
  for (const auto& frame : result.frames) {
    damaged_nodes += static_cast<std::uint64_t>(frame.matching.damaged_nodes);
    over_capacity += static_cast<std::uint64_t>(frame.matching.over_capacity);
  }
  note("map_node_damaged", damaged_nodes);
  note("match_over_capacity", over_capacity);
  return counts;
}

/// Medians over the frames that got as far as matching, stage by stage.
nlohmann::json stage_times(const BatchResult& result) {
  using Times = topoloc::matching::FrameReport::StageTimes;
  const std::map<std::string, double Times::*> stages{{"undistort", &Times::undistort_ms},
                                                      {"extract", &Times::extract_ms},
                                                      {"select", &Times::select_ms},
                                                      {"match", &Times::match_ms},
                                                      {"outliers", &Times::outliers_ms}};
  nlohmann::json out;
  for (const auto& [name, time_ms] : stages) {
    std::vector<double> values;
    for (const auto& frame : result.frames) {
      if (frame.matching.features > 0) {
        values.push_back(frame.matching.times.*time_ms);
      }
    }
    out[name] = median(values);
  }
  return out;
}

}  // namespace

nlohmann::json summary(const Drive& drive, const FrameLog* frames, const BatchResult& result) {
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
  const topoloc::estimation::Counters& c = result.counters;
  return {
      {"ticks", result.estimates},
      {"frames", result.frames.size()},
      {"map_updates_accepted", c.map_accepted()},
      {"map_updates_rejected", c.map_rejected()},
      {"doubts", c.doubts},
      {"imu_gaps", c.imu_gaps},
      {"median_inliers", median(inliers)},
      {"median_frame_ms", median(frame_ms)},
      {"median_stage_ms", stage_times(result)},
      {"verdicts", verdicts},
      {"can_messages_lost", drive.lost_messages},
      {"rejected", rejected(drive, frames, result)},
      {"first_malformed_line", drive.first_malformed_line},
      {"first_rejected_frame", frames != nullptr ? frames->first_error() : ""},
      {"log_damage", topoloc::apps::to_json(frames != nullptr ? frames->damage()
                                                              : topoloc::transport::LogDamage{})}};
}

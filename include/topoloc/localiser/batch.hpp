// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/drive/drive.hpp"
#include "topoloc/drive/frame_selection.hpp"
#include "topoloc/estimation/estimator.hpp"
#include "topoloc/map/map_file.hpp"
#include "topoloc/matching/map_matcher.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace topoloc::localiser {

struct BatchOptions {
  drive::FrameSelection frames = drive::FrameSelection::kAll;
  double start_s = 0.0;  ///< after the first inertial sample; what comes before is left out
  /// T_world_imu at the start; without it the drive's ground truth gives it.
  std::optional<RigidTransform> initial_pose = std::nullopt;
  bool use_speed = true;       ///< false: not even where vehicle.yaml says so
  double rate_hz = 200.0;      ///< ticks per second of drive time
  double match_delay_s = 0.0;  ///< how late match results reach the estimator
  /// A matcher that takes so long for a frame: results come that late, and the frames that come
  /// meanwhile are left out.
  double match_seconds = 0.0;
  matching::Effort effort = matching::Effort::kFull;  ///< of each frame
};

/// One frame: what matching made of it, and what the filter made of that.
struct FrameRecord {
  std::size_t frame_index = 0;
  std::int64_t time_ns = 0;
  matching::FrameReport matching;
  std::optional<estimation::MapUpdateReport>
      update;  ///< nothing if no match set reached the filter
};

struct BatchResult {
  std::uint64_t estimates = 0;      ///< handed to BatchObserver::estimate
  std::vector<FrameRecord> frames;  ///< those that decoded, from the start of the filter on
  std::uint64_t frames_before_start = 0;
  std::uint64_t frames_skipped = 0;  ///< came while the matcher was busy (match_seconds)
  estimation::Counters counters;
};

/// What a run tells while it goes.
struct BatchObserver {
  /// Of each tick, from the start of the filter on: not kept, an hour of them is gigabytes.
  std::function<void(const estimation::Estimate&)> estimate;
  std::function<void(double share)> progress;  ///< after each tick: of the drive, 0 to 1
};

/// A longer time without inertial samples is taken for a wrong time stamp: ticking through it could
/// take for ever.
inline constexpr double kMaxPause_s = 60.0;

/// Runs the localiser over a recorded drive as fast as it can, tick by tick in drive time: what the
/// vehicle process does with the same inputs. Deterministic. Without a map: dead reckoning.
///
/// Where the ground truth gives the initial pose, the filter starts with the first inertial sample
/// that it covers, at most one second after the start asked for.
///
/// Throws std::runtime_error where the drive has no initial pose, no data to start with, no wheel
/// speed although it is to be used, or a pause of more than kMaxPause_s.
BatchResult run_batch(const drive::Drive& drive, drive::FrameLog* frames, const map::MapFile* map,
                      const BatchOptions& options, const BatchObserver& observer);

}  // namespace topoloc::localiser

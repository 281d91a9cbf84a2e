// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/drive/drive.hpp"
#include "topoloc/estimation/estimator.hpp"
#include "topoloc/map/map_file.hpp"
#include "topoloc/matching/map_matcher.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace topoloc::localiser {

/// Which frames of a log are used, by their place in it: so that one drive can serve as map and as
/// query without a frame being matched with itself.
enum class FrameSelection { kAll, kEven, kOdd };

/// "all", "even" or "odd"; std::invalid_argument otherwise.
FrameSelection parse_frame_selection(const std::string& text);
bool selected(FrameSelection selection, std::size_t index);

struct BatchOptions {
  FrameSelection frames = FrameSelection::kAll;
  double start_s = 0.0;  ///< after the first inertial sample; what comes before is left out
  /// T_world_imu at the start; without it the drive's ground truth gives it.
  std::optional<RigidTransform> initial_pose;
  bool use_speed = true;
  double rate_hz = 200.0;      ///< ticks per second of drive time
  double match_delay_s = 0.0;  ///< how late match results reach the estimator
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
  std::vector<estimation::Estimate> estimates;  ///< one a tick, from the start of the filter on
  std::vector<FrameRecord> frames;
  std::uint64_t frames_undecodable = 0;
  std::uint64_t frames_before_start = 0;
  estimation::Counters counters;
};

/// Called after each tick with the share of the drive done, 0 to 1.
using Progress = std::function<void(double share)>;

/// Runs the localiser over a recorded drive as fast as it can, tick by tick in drive time: what the
/// vehicle process does with the same inputs. Deterministic. Without a map: dead reckoning.
/// Throws std::runtime_error where the drive has no initial pose or no data to start with.
BatchResult run_batch(const drive::Drive& drive, drive::FrameLog* frames, const map::MapFile* map,
                      const BatchOptions& options, const Progress& progress = {});

}  // namespace topoloc::localiser

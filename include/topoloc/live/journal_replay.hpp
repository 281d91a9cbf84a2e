// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/live/journal.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

namespace topoloc::live {

/// What became of a replay.
struct ReplaySummary {
  JournalSummary journal;
  std::uint64_t ticks = 0;  ///< replayed
  /// Ticks before the filter had a pose, of a journal that begins in the middle of a run.
  std::uint64_t left_out = 0;
  /// Times that the filter was started from a pose that it did not have then: one given, or one
  /// that a file of the journal begins with. What else it knew (velocity, biases, covariance) is
  /// not in the journal.
  std::uint64_t started = 0;
  bool pose_given = false;
  bool started_from_given = false;  ///< it could be started from it: there was a wheel speed

  /// The estimates are what the live process gave, bit for bit.
  [[nodiscard]] bool is_exact() const { return journal.is_whole() && started == 0 && !pose_given; }
};

/// Runs the estimator over a journal and hands out what it gave. The first files of a long run are
/// gone: then it starts from the pose that the first file begins with, else from the first initial
/// pose that the live process took; behind a gap likewise. `initial_pose`, taken as that of the
/// first tick with inertial data, comes before both, until the filter has started from it. Throws
/// as read_journal() does, and where the filter never starts.
ReplaySummary replay_journal(const std::filesystem::path& folder,
                             const estimation::EstimatorConfig& config,
                             const std::optional<RigidTransform>& initial_pose,
                             const std::function<void(const TickOutput&)>& take);

}  // namespace topoloc::live

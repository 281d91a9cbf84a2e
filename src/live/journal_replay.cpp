// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/journal_replay.hpp"

#include "topoloc/live/messages.hpp"

#include <stdexcept>

namespace topoloc::live {
namespace {

class Replay {
 public:
  Replay(const estimation::EstimatorConfig& config,
         const std::optional<RigidTransform>& initial_pose,
         const std::function<void(const TickOutput&)>& take)
      : runner_(config), given_(initial_pose), take_(take) {
    summary_.pose_given = initial_pose.has_value();
  }

  void begin_file(const JournalFileStart& file) {
    known_ = known_ || file.from_start;
    if (!given_ && file.pose && file.after_gap) {
      start_ = file.pose;
    }
  }

  void tick(const TickInput& recorded, const estimation::MapMatchSet* set) {
    const bool from_file = start_ && !recorded.initial_pose;
    const TickOutput& output = given_      ? run_from_given(recorded, set)
                               : from_file ? run_from_start(recorded, set)
                                           : runner_.run(recorded, set);
    start_.reset();
    // Only the filter knows whether it takes a pose.
    known_ = known_ || has_pose(output);
    if (known_) {
      ++summary_.ticks;
      take_(output);
    } else {
      ++summary_.left_out;
    }
  }

  ReplaySummary& summary() { return summary_; }

 private:
  /// Until the filter has started from it: the live process had a pose at the same time, or soon.
  const TickOutput& run_from_given(const TickInput& recorded, const estimation::MapMatchSet* set) {
    TickInput input = recorded;
    input.initial_pose.reset();
    if (!offered_ && recorded.imu_count > 0) {
      input.initial_pose = {.time_ns = recorded.imu[0].time_ns, .T_world_imu = *given_};
      offered_ = true;
    }
    const estimation::Counters before = runner_.estimator().counters();
    const TickOutput& output = runner_.run(input, set);
    const estimation::Counters& after = output.estimate.counters;
    if (after.starts > before.starts) {
      given_.reset();
      ++summary_.started;
      summary_.started_from_given = true;
    } else if (after.initial_pose_rejected > before.initial_pose_rejected) {
      offered_ = false;  // no wheel speed came in time: with the next inertial data
    }
    return output;
  }

  const TickOutput& run_from_start(const TickInput& recorded, const estimation::MapMatchSet* set) {
    TickInput input = recorded;
    input.initial_pose = start_;
    ++summary_.started;
    return runner_.run(input, set);
  }

  TickRunner runner_;
  std::optional<RigidTransform> given_;  // until the filter has started from it
  bool offered_ = false;
  const std::function<void(const TickOutput&)>& take_;
  std::optional<estimation::InitialPose> start_;  // with the next tick
  bool known_ = false;                            // what the filter knew at this tick
  ReplaySummary summary_;
};

}  // namespace

ReplaySummary replay_journal(const std::filesystem::path& folder,
                             const estimation::EstimatorConfig& config,
                             const std::optional<RigidTransform>& initial_pose,
                             const std::function<void(const TickOutput&)>& take) {
  Replay replay(config, initial_pose, take);
  const JournalSummary journal = read_journal(
      folder, {.file = [&](const JournalFileStart& file) { replay.begin_file(file); },
               .tick = [&](const TickInput& tick,
                           const estimation::MapMatchSet* set) { replay.tick(tick, set); }});
  ReplaySummary summary = replay.summary();
  summary.journal = journal;
  if (summary.ticks == 0) {
    throw std::runtime_error(
        folder.string() +
        (journal.other_version ? ": the journal was written by another version of topoloc"
                               : ": the journal begins in the middle of a run") +
        ", and in it the filter never starts from a pose: give one (--initial-pose)");
  }
  return summary;
}

}  // namespace topoloc::live

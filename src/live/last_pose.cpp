// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/last_pose.hpp"

#include "topoloc/evaluation/trajectory.hpp"

#include "live/stop_event.hpp"

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <system_error>

namespace topoloc::live {
namespace {

constexpr double kStanding_mps = 0.3;

/// Without inertial data the filter goes on with the last sample, and with nothing else it adds up
/// their bias and noise: its velocity then says nothing.
bool knows_velocity(const estimation::Estimate& estimate) {
  namespace reason = estimation::reason;
  constexpr std::uint32_t kInertialOnly = reason::kNoSpeed | reason::kNoMapFix;
  return estimate.mode != estimation::Mode::kUninitialised &&
         (estimate.reasons & reason::kNoImu) == 0U &&
         (estimate.reasons & kInertialOnly) != kInertialOnly;
}

/// The filter may not take them: it needs inertial data of their time.
bool wheels_turn(const TickOutput& output) {
  constexpr std::int64_t kFresh_ns = 500'000'000;
  return std::abs(output.now_ns - output.speed.time_ns) <= kFresh_ns &&
         std::abs(output.speed.speed_mps) >= kStanding_mps;
}

}  // namespace

// A vehicle that is switched off loses its sensors one after the other before the process ends.
// That is no movement, and the pose is what the next start needs.
LastPoseVerdict judge_last_pose(const TickOutput& output) {
  const estimation::Estimate& estimate = output.estimate;
  if (!knows_velocity(estimate)) {
    return wheels_turn(output) ? LastPoseVerdict::kRemove : LastPoseVerdict::kLeave;
  }
  if (estimate.state.v_world_imu.norm() >= kStanding_mps) {
    return LastPoseVerdict::kRemove;
  }
  return estimate.mode == estimation::Mode::kTracking ? LastPoseVerdict::kKeep
                                                      : LastPoseVerdict::kLeave;
}

bool write_last_pose(const std::filesystem::path& file, const LastPose& pose) {
  std::filesystem::path beside = file;
  beside += ".tmp";
  try {
    evaluation::write_tum(beside, {{pose.time_ns, pose.T_world_imu}});
    std::filesystem::rename(beside, file);
  } catch (const std::exception&) {
    std::error_code ignored;
    std::filesystem::remove(beside, ignored);
    return false;
  }
  return true;
}

std::optional<LastPose> read_last_pose(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) {
    return std::nullopt;
  }
  const evaluation::Trajectory poses = evaluation::read_tum(file);
  return LastPose{poses.back().time_ns, poses.back().T_world_imu};
}

void LastPoseKeeper::run(const StopEvent& stop) {
  constexpr int kPause_ms = 20;
  std::optional<LastPose> pose;
  bool stopping = false;
  while (!stopping) {
    stopping = stop.wait(kPause_ms);
    if (newest_.take(pose, std::chrono::nanoseconds::zero()) != realtime::MailboxTake::kTaken) {
      continue;
    }
    if (pose) {
      failed_.fetch_add(write_last_pose(file_, *pose) ? 0 : 1, std::memory_order_relaxed);
    } else {
      std::error_code ignored;
      std::filesystem::remove(file_, ignored);
    }
  }
}

}  // namespace topoloc::live

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/last_pose.hpp"

#include "topoloc/evaluation/trajectory.hpp"

#include "live/stop_event.hpp"

#include <chrono>
#include <exception>
#include <system_error>

namespace topoloc::live {

// A vehicle that is switched off loses its sensors one after the other before the process ends.
// That is no movement, and the pose is what the next start needs. Without inertial data the filter
// goes on with the last sample, so that its velocity says nothing.
LastPoseVerdict judge_last_pose(const estimation::Estimate& estimate) {
  constexpr double kStanding_mps = 0.3;
  if (estimate.mode == estimation::Mode::kUninitialised ||
      (estimate.reasons & estimation::reason::kNoImu) != 0U) {
    return LastPoseVerdict::kLeave;
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

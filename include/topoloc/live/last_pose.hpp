// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/live/tick.hpp"
#include "topoloc/realtime/mailbox.hpp"

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

namespace topoloc::live {

class StopEvent;

/// A pose kept over a restart of the process.
struct LastPose {
  std::int64_t time_ns = 0;  ///< Unix
  RigidTransform T_world_imu;
};

/// What a tick's output means for the pose that is kept.
enum class LastPoseVerdict : std::uint8_t {
  kKeep,    ///< the vehicle stands and knows where: keep this pose
  kRemove,  ///< it moves: the pose kept is wrong by the time it would be started from
  kLeave,   ///< neither is known
};
LastPoseVerdict judge_last_pose(const TickOutput& output);

/// Writes a TUM file of one pose, whole or not at all. Returns whether it could.
bool write_last_pose(const std::filesystem::path& file, const LastPose& pose);

/// Nothing if the file is not there. Throws std::runtime_error, naming file and line, if it is
/// damaged.
std::optional<LastPose> read_last_pose(const std::filesystem::path& file);

/// Writes poses in a thread of its own, so that a disk that hangs holds up nothing else.
class LastPoseKeeper {
 public:
  explicit LastPoseKeeper(std::filesystem::path file) : file_(std::move(file)) {}

  /// The pose to be kept from now on, or none: the file is removed. Does not wait for the disk; for
  /// any thread.
  void keep(std::optional<LastPose> pose) { newest_.put(pose); }

  /// Until `stop` is set and the newest pose is written.
  void run(const StopEvent& stop);

  /// Times that the pose could not be written.
  [[nodiscard]] std::uint64_t failed() const { return failed_.load(std::memory_order_relaxed); }

 private:
  std::filesystem::path file_;
  realtime::Mailbox<std::optional<LastPose>> newest_;
  std::atomic<std::uint64_t> failed_{0};
};

}  // namespace topoloc::live

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>

namespace topoloc::live {

/// The one time line of the vehicle process: Unix nanoseconds when it started, and steady from then
/// on, whoever sets the system clock. Stamps by the system clock (CAN frames, camera frames) are
/// brought onto it as soon as they come in.
///
/// One object per thread; none of its functions locks or allocates.
class HostClock {
 public:
  HostClock();
  /// The same time line for another thread.
  HostClock(const HostClock&) = default;
  HostClock& operator=(const HostClock&) = delete;

  /// Time on the line.
  [[nodiscard]] std::int64_t now_ns() const;

  /// Looks whether the system clock was set; to be called now and then, before stamps are
  /// converted.
  void watch();
  /// What was added to the system clock since the start, slewing not counted.
  [[nodiscard]] std::int64_t system_offset_ns() const { return system_offset_ns_; }
  /// How often that was done.
  [[nodiscard]] std::uint64_t steps() const { return steps_; }

  /// A stamp of the system clock, on the line.
  [[nodiscard]] std::int64_t from_system(std::int64_t stamp_ns) const {
    return stamp_ns - system_offset_ns_;
  }

 private:
  std::int64_t origin_ns_;  // of the line, on CLOCK_MONOTONIC's
  std::int64_t system_offset_ns_ = 0;
  std::uint64_t steps_ = 0;
};

}  // namespace topoloc::live

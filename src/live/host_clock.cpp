// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/host_clock.hpp"

#include <cstdlib>
#include <limits>
#include <time.h>

namespace topoloc::live {
namespace {

std::int64_t read_ns(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

/// How far the system clock is ahead of the monotonic one, and between which bounds that was read.
struct Reading {
  std::int64_t ahead_ns = 0;
  std::int64_t within_ns = std::numeric_limits<std::int64_t>::max();
};

Reading system_ahead() {
  // Both clocks are slewed alike, so their difference changes by steps only. A thread that is
  // interrupted between the readings sees a false one: the tightest of a few is taken.
  constexpr int kReadings = 3;
  Reading best;
  for (int i = 0; i < kReadings; ++i) {
    const std::int64_t before_ns = read_ns(CLOCK_MONOTONIC);
    const std::int64_t system_ns = read_ns(CLOCK_REALTIME);
    const std::int64_t within_ns = read_ns(CLOCK_MONOTONIC) - before_ns;
    if (within_ns < best.within_ns) {
      best = {system_ns - before_ns - within_ns / 2, within_ns};
    }
  }
  return best;
}

}  // namespace

HostClock::HostClock() : origin_ns_(system_ahead().ahead_ns) {}

std::int64_t HostClock::now_ns() const { return read_ns(CLOCK_MONOTONIC) + origin_ns_; }

void HostClock::watch() {
  constexpr std::int64_t kStep_ns = 1'000'000;
  constexpr std::int64_t kInterrupted_ns = 100'000;
  const Reading reading = system_ahead();
  const std::int64_t offset_ns = reading.ahead_ns - origin_ns_;
  if (reading.within_ns < kInterrupted_ns && std::abs(offset_ns - system_offset_ns_) > kStep_ns) {
    system_offset_ns_ = offset_ns;
    ++steps_;
  }
}

}  // namespace topoloc::live

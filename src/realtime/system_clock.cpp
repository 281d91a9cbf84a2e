// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/system_clock.hpp"

#include "topoloc/realtime/monotonic_clock.hpp"

#include <limits>
#include <time.h>

namespace topoloc::realtime {
namespace {

std::int64_t unix_now_ns() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

}  // namespace

SystemAhead read_system_ahead() {
  // A thread that is interrupted between the readings sees a false difference. Where each call is
  // a stop of its own (a guest, a machine without time), a few readings may all be such.
  constexpr int kReadings = 3;
  constexpr int kMostReadings = 50;
  constexpr std::int64_t kInterrupted_ns = 50'000;
  SystemAhead best{.ahead_ns = 0, .within_ns = std::numeric_limits<std::int64_t>::max()};
  for (int i = 0; i < kReadings || (i < kMostReadings && best.within_ns > kInterrupted_ns); ++i) {
    const std::int64_t before_ns = MonotonicClock::now_ns();
    const std::int64_t system_ns = unix_now_ns();
    const std::int64_t within_ns = MonotonicClock::now_ns() - before_ns;
    if (within_ns < best.within_ns) {
      best = {.ahead_ns = system_ns - before_ns - within_ns / 2, .within_ns = within_ns};
    }
  }
  return best;
}

}  // namespace topoloc::realtime

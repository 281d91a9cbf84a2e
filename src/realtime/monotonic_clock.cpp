// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/monotonic_clock.hpp"

#include <cerrno>
#include <ctime>

namespace topoloc::realtime {

namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

}  // namespace

std::int64_t MonotonicClock::now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecond_ns + now.tv_nsec;
}

void MonotonicClock::sleep_until(std::int64_t time_ns) {
  const timespec until{.tv_sec = time_ns / kSecond_ns, .tv_nsec = time_ns % kSecond_ns};
  // Not zero: a signal came first. The time is absolute, so sleeping again is all there is to do;
  // an error other than that (a time before zero) must not loop for ever.
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

}  // namespace topoloc::realtime

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/host_clock.hpp"

#include "topoloc/realtime/monotonic_clock.hpp"
#include "topoloc/realtime/system_clock.hpp"

#include <cstdlib>

namespace topoloc::live {

HostClock::HostClock() : origin_ns_(realtime::read_system_ahead().ahead_ns) {}

std::int64_t HostClock::now_ns() const { return realtime::MonotonicClock::now_ns() + origin_ns_; }

void HostClock::watch() {
  constexpr std::int64_t kStep_ns = 1'000'000;
  constexpr std::int64_t kInterrupted_ns = 100'000;
  const realtime::SystemAhead reading = realtime::read_system_ahead();
  const std::int64_t offset_ns = reading.ahead_ns - origin_ns_;
  if (reading.within_ns < kInterrupted_ns && std::abs(offset_ns - system_offset_ns_) > kStep_ns) {
    system_offset_ns_ = offset_ns;
    ++steps_;
  }
}

}  // namespace topoloc::live

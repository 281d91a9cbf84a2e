// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/monotonic_clock.hpp"
#include "topoloc/realtime/system_clock.hpp"
#include "topoloc/replay/player.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace topoloc::replay {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kLead_ns = 200'000'000;
constexpr std::int64_t kNap_ns = 50'000'000;

}  // namespace

using realtime::MonotonicClock;

Pacer::Pacer(double speed) : speed_(speed), start_ns_(MonotonicClock::now_ns() + kLead_ns) {}

std::int64_t Pacer::due_ns(std::int64_t elapsed_ns) const {
  return start_ns_ + std::llround(static_cast<double>(elapsed_ns) / speed_);
}

bool Pacer::wait_until(std::int64_t elapsed_ns, const std::atomic<bool>& stop) const {
  const std::int64_t due = due_ns(elapsed_ns);
  for (;;) {
    if (stop.load(std::memory_order_relaxed)) {
      return false;
    }
    const std::int64_t now = MonotonicClock::now_ns();
    if (now >= due) {
      return true;
    }
    const std::int64_t until = std::min(due, now + kNap_ns);
    const timespec time = {.tv_sec = until / kSecond_ns, .tv_nsec = until % kSecond_ns};
    ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr);
  }
}

std::int64_t Pacer::late_ns(std::int64_t elapsed_ns) const {
  return MonotonicClock::now_ns() - due_ns(elapsed_ns);
}

std::int64_t Pacer::unix_ns(std::int64_t elapsed_ns) const {
  return realtime::read_system_ahead().ahead_ns + due_ns(elapsed_ns);
}

}  // namespace topoloc::replay

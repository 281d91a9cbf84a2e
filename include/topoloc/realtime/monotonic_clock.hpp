// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>

namespace topoloc::realtime {

/// CLOCK_MONOTONIC: not set by anyone, so a period stays a period when the time of day is put
/// right. Any thread; neither function fails or allocates.
struct MonotonicClock {
  /// Nanoseconds since an arbitrary start, mostly that of the machine.
  [[nodiscard]] static std::int64_t now_ns();
  /// Returns at that time or, if it has gone by, at once. Signals do not end it.
  static void sleep_until(std::int64_t time_ns);
};

}  // namespace topoloc::realtime

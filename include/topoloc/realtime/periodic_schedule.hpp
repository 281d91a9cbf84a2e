// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>

namespace topoloc::realtime {

/// Absolute deadlines at a fixed period, each of which is either met or missed.
///
/// Period k starts at `first + k * period`. enter() tells which period a time lies in; periods that
/// went by since the last one entered are missed, and skipped: to catch up by running twice as
/// often would make a busy system busier. Deadlines never drift, whatever the periods take. So, at
/// any time, periods entered + missed = periods begun.
///
/// No clock, no thread of its own: times are given. One thread at a time.
class PeriodicSchedule {
 public:
  /// `period_ns` above zero.
  constexpr PeriodicSchedule(std::int64_t first_ns, std::int64_t period_ns)
      : first_ns_(first_ns), period_ns_(period_ns) {}

  /// Start of the first period not entered yet and not missed.
  [[nodiscard]] constexpr std::int64_t deadline_ns() const {
    return first_ns_ + next_ * period_ns_;
  }

  struct Entered {
    std::int64_t index = 0;        ///< of the period, from 0
    std::int64_t deadline_ns = 0;  ///< its start
    std::int64_t missed = 0;       ///< periods skipped to get there
  };

  /// Enters the period that `now_ns` lies in; a time before deadline_ns() enters that one.
  constexpr Entered enter(std::int64_t now_ns) {
    const std::int64_t late_ns = now_ns - deadline_ns();
    const std::int64_t missed = late_ns > 0 ? late_ns / period_ns_ : 0;
    const std::int64_t index = next_ + missed;
    next_ = index + 1;
    return {.index = index, .deadline_ns = first_ns_ + index * period_ns_, .missed = missed};
  }

 private:
  std::int64_t first_ns_;
  std::int64_t period_ns_;
  std::int64_t next_ = 0;
};

}  // namespace topoloc::realtime

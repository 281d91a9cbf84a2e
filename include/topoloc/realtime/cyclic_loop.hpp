// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/realtime/latency_histogram.hpp"
#include "topoloc/realtime/monotonic_clock.hpp"
#include "topoloc/realtime/periodic_schedule.hpp"

#include <atomic>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

namespace topoloc::realtime {

/// One run of a cyclic loop's work. Times of the loop's clock.
struct Cycle {
  std::int64_t index = 0;        ///< of the period since the loop's start; missed ones have theirs
  std::int64_t deadline_ns = 0;  ///< start of the period
  std::int64_t woken_ns = 0;     ///< start of the work
  std::int64_t missed = 0;       ///< periods without work since the last cycle
};

/// How a cyclic loop has done so far; about 16 kB, trivially copyable.
///
/// cycles + missed = periods begun from first_deadline_ns up to last_woken_ns, exactly.
struct CycleStats {
  std::int64_t period_ns = 0;
  std::int64_t first_deadline_ns = 0;  ///< of the loop's clock
  std::int64_t last_woken_ns = 0;
  std::uint64_t cycles = 0;    ///< periods with work
  std::uint64_t missed = 0;    ///< periods without
  std::uint64_t overruns = 0;  ///< cycles whose work had not ended when the next period began
  /// From the deadline to the return from sleep: what the system adds. Nothing is recorded after an
  /// overrun, since there was no sleep: that is the work's own doing, and told by its time.
  LatencyHistogram wakeup_latency;
  LatencyHistogram execution_time;  ///< of the work
};

/// Calls work once per period, on absolute time, in the thread that calls run().
///
/// Does not allocate, lock or throw after construction (the work may). The clock is a parameter for
/// tests only.
template <typename Clock = MonotonicClock>
class CyclicLoop {
 public:
  /// Throws std::invalid_argument unless the period is above zero.
  explicit CyclicLoop(std::int64_t period_ns, Clock clock = {}) : clock_(std::move(clock)) {
    if (period_ns <= 0) {
      throw std::invalid_argument("CyclicLoop: period must be above 0 ns, found " +
                                  std::to_string(period_ns));
    }
    stats_.period_ns = period_ns;
  }

  /// Runs `work(const Cycle&)` until `stop` is set, by the work or another thread: then it ends
  /// within one period and what the work takes. The first deadline is one period from now. Starts
  /// the statistics anew.
  template <typename Work>
  void run(const std::atomic<bool>& stop, Work&& work) {
    const std::int64_t period_ns = stats_.period_ns;
    stats_ = {};
    stats_.period_ns = period_ns;
    std::int64_t now_ns = clock_.now_ns();
    stats_.first_deadline_ns = now_ns + period_ns;
    PeriodicSchedule schedule(stats_.first_deadline_ns, period_ns);
    while (true) {
      const std::int64_t deadline_ns = schedule.deadline_ns();
      const bool overrun = now_ns >= deadline_ns;
      if (!overrun) {
        // Absolute: a relative sleep would add the time that passes before it starts, every time.
        clock_.sleep_until(deadline_ns);
        now_ns = clock_.now_ns();
      }
      if (stop.load(std::memory_order_acquire)) {
        return;
      }
      const PeriodicSchedule::Entered entered = schedule.enter(now_ns);
      note_start(now_ns, deadline_ns, overrun, entered);
      const Cycle cycle{.index = entered.index,
                        .deadline_ns = entered.deadline_ns,
                        .woken_ns = now_ns,
                        .missed = entered.missed};
      work(cycle);
      now_ns = clock_.now_ns();
      stats_.execution_time.record(now_ns - cycle.woken_ns);
    }
  }

  /// For the looping thread (in its work, the last cycle's time is not in it yet), or when run()
  /// has returned. Hand other threads a copy through a TripleBuffer.
  [[nodiscard]] const CycleStats& stats() const { return stats_; }

 private:
  void note_start(std::int64_t woken_ns, std::int64_t deadline_ns, bool overrun,
                  const PeriodicSchedule::Entered& entered) {
    ++stats_.cycles;
    stats_.missed += static_cast<std::uint64_t>(entered.missed);
    stats_.last_woken_ns = woken_ns;
    if (overrun) {
      ++stats_.overruns;
    } else {
      // From the deadline slept for, not from that of the period entered: a sleep that takes three
      // periods too long is three periods late.
      stats_.wakeup_latency.record(woken_ns - deadline_ns);
    }
  }

  Clock clock_;
  CycleStats stats_;
};

}  // namespace topoloc::realtime

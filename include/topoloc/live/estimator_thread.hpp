// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/live/estimator_loop.hpp"
#include "topoloc/realtime/cyclic_loop.hpp"
#include "topoloc/realtime/memory_lock.hpp"
#include "topoloc/realtime/thread.hpp"
#include "topoloc/realtime/triple_buffer.hpp"

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

namespace topoloc::live {

/// How the estimator thread has kept its rate, and what it reports of its loop.
struct EstimatorThreadStatus {
  realtime::CycleStats cycles;
  realtime::PageFaults page_faults;  ///< since its first tick
  EstimatorStatus loop;
};

/// Runs an EstimatorLoop at a fixed rate. Between its first and its last tick the thread does not
/// allocate, lock, touch files or throw (realtime::ForbidBlocking, where traps are built in).
class EstimatorThread {
 public:
  struct Config {
    double rate_hz = 200.0;
    realtime::ThreadConfig thread;
    int wake_fd = -1;  ///< eventfd that is written after each tick, so that others can sleep on it
  };

  EstimatorThread(const Config& config, EstimatorLoop& loop);
  /// Stops it.
  ~EstimatorThread();
  EstimatorThread(const EstimatorThread&) = delete;
  EstimatorThread& operator=(const EstimatorThread&) = delete;

  [[nodiscard]] const std::vector<std::string>& warnings() const { return thread_.warnings(); }
  void start() { thread_.start(); }
  /// Within a period; afterwards the last status is there.
  void stop();

  /// Ticks so far; for any thread.
  [[nodiscard]] std::uint64_t ticks() const { return ticks_.load(std::memory_order_relaxed); }
  /// Newest status, of about ten a second: for one reading thread.
  const EstimatorThreadStatus& status();

 private:
  void run();
  void hand_out_status();

  Config config_;
  EstimatorLoop& loop_;
  realtime::CyclicLoop<> cycles_;
  realtime::TripleBuffer<EstimatorThreadStatus> status_;
  realtime::PageFaults faults_before_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> ticks_{0};
  realtime::Thread thread_;  // last: it runs on the members above
};

}  // namespace topoloc::live

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/estimator_thread.hpp"

#include "topoloc/realtime/forbid_blocking.hpp"

#include <algorithm>
#include <cmath>
#include <sys/eventfd.h>

namespace topoloc::live {

EstimatorThread::EstimatorThread(const Config& config, EstimatorLoop& loop)
    : config_(config),
      loop_(loop),
      cycles_(std::llround(1e9 / config.rate_hz)),
      thread_(config.thread, [this] { run(); }) {}

EstimatorThread::~EstimatorThread() { stop(); }

void EstimatorThread::stop() {
  stop_.store(true, std::memory_order_release);
  thread_.join();
}

const EstimatorThreadStatus& EstimatorThread::status() {
  (void)status_.update();
  return status_.read();
}

void EstimatorThread::run() {
  constexpr std::int64_t kStatusPeriod_ns = 100'000'000;
  const std::int64_t every =
      std::max<std::int64_t>(1, kStatusPeriod_ns / cycles_.stats().period_ns);
  faults_before_ = realtime::thread_page_faults();
  {
    const realtime::ForbidBlocking forbidden;
    std::int64_t until_status = every;
    cycles_.run(stop_, [&](const realtime::Cycle& cycle) {
      loop_.tick(static_cast<std::uint64_t>(cycle.index));
      ticks_.store(cycles_.stats().cycles, std::memory_order_relaxed);
      eventfd_write(config_.wake_fd, 1);
      if (--until_status <= 0) {
        until_status = every;
        hand_out_status();
      }
    });
  }
  hand_out_status();
}

void EstimatorThread::hand_out_status() {
  EstimatorThreadStatus& status = status_.write_slot();
  status.cycles = cycles_.stats();
  const realtime::PageFaults now = realtime::thread_page_faults();
  status.page_faults = {now.minor - faults_before_.minor, now.major - faults_before_.major};
  loop_.report(status.loop);
  status_.publish();
}

}  // namespace topoloc::live

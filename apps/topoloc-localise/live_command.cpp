// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/live_process.hpp"

#include "commands.hpp"
#include "common/initial_pose.hpp"
#include "common/text_file.hpp"
#include "service_notifier.hpp"
#include "vehicle_options.hpp"

#include <csignal>
#include <cstdlib>

#include <fmt/core.h>

namespace topoloc::apps {
namespace {

/// Exit code of a process that was told to end and did, but for what it had to write. Not that of a
/// failure: nobody shall start it again (RestartPreventExitStatus= of the unit).
constexpr int kDiskHangs = 3;

/// SIGTERM and SIGINT, taken in by the main thread when it asks: no other thread is interrupted.
class EndSignals {
 public:
  EndSignals() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGTERM);
    sigaddset(&signals_, SIGINT);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }

  /// Waits a twentieth of a second at most; whether one came.
  [[nodiscard]] bool wait() const { return came_within(50'000'000); }
  /// Whether one has come.
  [[nodiscard]] bool came() const { return came_within(0); }

 private:
  [[nodiscard]] bool came_within(long ns) const {
    const timespec timeout{.tv_sec = 0, .tv_nsec = ns};
    return sigtimedwait(&signals_, nullptr, &timeout) > 0;
  }

  sigset_t signals_{};
};

void print_end(const live::ProcessStatus& status) {
  const realtime::CycleStats& cycles = status.estimator.cycles;
  fmt::print(
      "stopped: {} estimates published, {} ticks missed, {} map fixes accepted, {} rejected, "
      "last mode {}\n",
      status.publisher.published, cycles.missed, status.newest.estimate.counters.map_accepted(),
      status.newest.estimate.counters.map_rejected(),
      estimation::name(status.newest.estimate.mode));
}

}  // namespace

int localise_live(const Options& options) {
  const EndSignals signals;  // before any thread
  live::LiveOptions live{.vehicle_yaml = read_text(options.config),
                         .version = TOPOLOC_VERSION,
                         .map = {},
                         .initial_pose = {}};
  if (!options.dead_reckoning) {
    live.map = options.map;
  }
  if (!options.initial_pose.empty()) {
    live.initial_pose = parse_initial_pose(options.initial_pose);
  }
  live::LiveProcess process(load_vehicle(options), std::move(live));
  if (signals.came()) {  // while models and map were read
    fmt::print("stopped before the start\n");
    return 0;
  }
  const ServiceNotifier service;
  process.start();
  for (const std::string& warning : process.warnings()) {
    fmt::print(stderr, "topoloc-localise: warning: {}\n", warning);
  }
  service.notify("READY=1");
  fmt::print("running\n");
  std::fflush(stdout);

  std::uint64_t ticks = 0;
  while (!signals.wait() && !process.stop_requested()) {
    // A watchdog of the system restarts a process whose estimator does not tick.
    const std::uint64_t now = process.ticks();
    if (now != ticks) {
      service.notify("WATCHDOG=1");
    }
    ticks = now;
  }
  service.notify("STOPPING=1");
  const bool written = process.stop();
  print_end(process.last_status());
  if (!written) {
    fmt::print(stderr,
               "topoloc-localise: the disk does not answer: the end of the journal, or the last "
               "pose, is not written\n");
  }
  // The system takes back memory, map and models faster than destructors do, and does not wait for
  // a matcher in the middle of a frame.
  std::fflush(stdout);
  std::_Exit(written ? 0 : kDiskHangs);
}

}  // namespace topoloc::apps

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
// Execution time and wake-up latency of the estimator's tick, as it is in the vehicle process: a
// real-time thread on absolute time, CAN frames in, a full match set of 0.1 s before ten times a
// second, estimates and journal out. tools/tick_latency.py runs it beside cyclictest.
#include "topoloc/live/estimator_loop.hpp"
#include "topoloc/realtime/cyclic_loop.hpp"
#include "topoloc/realtime/forbid_blocking.hpp"
#include "topoloc/realtime/memory_lock.hpp"
#include "topoloc/realtime/thread.hpp"

#include "common/run_app.hpp"
#include "support/camera_scene.hpp"
#include "support/scripted_bus.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

namespace topoloc::live {
namespace {

using namespace std::chrono_literals;
using realtime::LatencyHistogram;
using realtime::MonotonicClock;

constexpr double kRate_hz = 200.0;
constexpr std::int64_t kFramePeriod_ns = 100'000'000;
constexpr std::int64_t kMatchDelay_ns = 100'000'000;
constexpr int kMatches = 1024;

struct Options {
  double seconds = 600.0;
  int priority = 80;
  int cpu = -1;
};

/// The estimator's thread with its inputs and the readers of its outputs.
class TickBench {
 public:
  explicit TickBench(const Options& options)
      : options_(options),
        car_(static_cast<int>(options.seconds * 1e9 / (DrivenCar::kPeriod_us * 1000.0)) + 100) {
    car_.vehicle.estimator.models.camera = camera_;
    signals_ = std::make_unique<can::VehicleSignals>(car_.vehicle.can);
    bus_ = std::make_unique<ScriptedBus>(car_, clock_);
    start_ns_ = clock_.now_ns();
    loop_ = std::make_unique<EstimatorLoop>(
        EstimatorLoop::Config{.estimator = car_.vehicle.estimator, .journal = true}, clock_,
        *signals_, *bus_, ports_);
    loop_->start_from({Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()});
  }

  void run() {
    realtime::Thread thread(
        {.name = "estimator",
         .fifo_priority = options_.priority,
         .cpus = options_.cpu >= 0 ? std::vector<int>{options_.cpu} : std::vector<int>{},
         .stack_bytes = 512 * 1024},
        [this] { tick_until_stopped(); });
    warnings_ = thread.warnings();
    const realtime::MemoryLock lock = realtime::lock_memory();
    if (!lock.locked) {
      warnings_.push_back(lock.warning);
    }
    std::jthread reader([this] { read_outputs(); });
    thread.start();
    const auto until =
        std::chrono::steady_clock::now() + std::chrono::duration<double>(options_.seconds);
    for (auto next = std::chrono::steady_clock::now(); next < until;
         next += std::chrono::nanoseconds(kFramePeriod_ns)) {
      std::this_thread::sleep_until(next);
      hand_over_matches();
    }
    stop_ = true;
    thread.join();
  }

  [[nodiscard]] nlohmann::json result() const {
    return {{"seconds", options_.seconds},
            {"warnings", warnings_},
            {"ticks", {{"done", stats_.cycles}, {"missed", stats_.missed}}},
            {"match_sets", {{"accepted", accepted_}, {"handed_over", handed_over_}}},
            {"page_faults", page_faults_},
            {"tick_without_update", summary(without_update_)},
            {"tick_with_update", summary(with_update_)},
            {"wake_up", summary(stats_.wakeup_latency)}};
  }

 private:
  static nlohmann::json summary(const LatencyHistogram& histogram) {
    const realtime::LatencySummary s = histogram.summary();
    const auto us = [](std::int64_t ns) { return 1e-3 * static_cast<double>(ns); };
    return {{"count", s.count},
            {"p50_us", us(s.p50_ns)},
            {"p99_us", us(s.p99_ns)},
            {"p999_us", us(s.p999_ns)},
            {"max_us", us(s.max_ns)}};
  }

  void tick_until_stopped() {
    realtime::CyclicLoop<> cycles(std::llround(1e9 / kRate_hz));
    const realtime::PageFaults before = realtime::thread_page_faults();
    {
      const realtime::ForbidBlocking forbidden;
      cycles.run(stop_, [&](const realtime::Cycle& cycle) {
        const std::uint64_t accepted_before = accepted_;
        const TickOutput& output = loop_->tick(static_cast<std::uint64_t>(cycle.index));
        accepted_ = output.estimate.counters.map_accepted();
        const std::int64_t took_ns = MonotonicClock::now_ns() - cycle.woken_ns;
        (accepted_ > accepted_before ? with_update_ : without_update_).record(took_ns);
      });
    }
    const realtime::PageFaults after = realtime::thread_page_faults();
    page_faults_ = after.minor - before.minor + after.major - before.major;
    stats_ = cycles.stats();
  }

  /// Of where the car was 0.1 s ago; it begins to drive at the origin.
  void hand_over_matches() {
    NumberedMatchSet* const slot = ports_.match_sets.write_slot();
    const std::int64_t frame_ns = clock_.now_ns() - kMatchDelay_ns;
    if (slot == nullptr || frame_ns < start_ns_ + kFramePeriod_ns) {
      return;
    }
    const double driven_m =
        DrivenCar::kSpeed_mps * 1e-9 *
        static_cast<double>(frame_ns - start_ns_ - 1000 * DrivenCar::kPeriod_us);
    test::fill_matches({Eigen::Matrix3d::Identity(), {driven_m, 0.0, 0.0}}, camera_, kMatches, 1.0,
                       random_, slot->set);
    slot->set.frame_time_ns = frame_ns;
    slot->set.nodes[0].covariance = 1e-4 * Eigen::Matrix<double, 6, 6>::Identity();
    slot->set.nodes[0].node_id = static_cast<std::uint32_t>(handed_over_ / 10);
    slot->number = handed_over_++;
    ports_.match_sets.commit_write();
  }

  void read_outputs() {
    while (!stop_) {
      while (ports_.outputs.read_slot() != nullptr) {
        ports_.outputs.commit_read();
      }
      while (ports_.journal.read_slot() != nullptr) {
        ports_.journal.commit_read();
      }
      std::this_thread::sleep_for(20ms);
    }
  }

  Options options_;
  estimation::CameraModel camera_ = test::forward_camera();
  DrivenCar car_;
  HostClock clock_;
  EstimatorPorts ports_;
  std::unique_ptr<can::VehicleSignals> signals_;
  std::unique_ptr<ScriptedBus> bus_;
  std::unique_ptr<EstimatorLoop> loop_;
  std::int64_t start_ns_ = 0;
  test::Random random_{1};
  std::uint64_t handed_over_ = 0;
  std::atomic<bool> stop_{false};
  // Written by the estimator's thread, read once it has ended.
  std::uint64_t accepted_ = 0;
  LatencyHistogram with_update_;
  LatencyHistogram without_update_;
  realtime::CycleStats stats_;
  std::uint64_t page_faults_ = 0;
  std::vector<std::string> warnings_;
};

}  // namespace
}  // namespace topoloc::live

int main(int argc, char** argv) {
  CLI::App app{"Tick of the estimator thread at 200 Hz with match sets arriving; JSON on stdout."};
  topoloc::live::Options options;
  app.add_option("--seconds", options.seconds, "How long")
      ->check(CLI::Range(1.0, 36000.0))
      ->capture_default_str();
  app.add_option("--priority", options.priority, "SCHED_FIFO priority, 0 for none")
      ->check(CLI::Range(0, 99))
      ->capture_default_str();
  app.add_option("--cpu", options.cpu, "CPU to run on; default: any")->check(CLI::Range(0, 1023));
  return topoloc::apps::run_app(app, "topoloc-tick-latency", argc, argv, [&] {
    topoloc::live::TickBench bench(options);
    bench.run();
    fmt::print("{}\n", bench.result().dump(2));
    return topoloc::apps::kDone;
  });
}

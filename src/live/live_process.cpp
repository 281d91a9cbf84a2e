// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/live_process.hpp"

#include "topoloc/can/can_receiver.hpp"
#include "topoloc/drive/drive.hpp"
#include "topoloc/live/last_pose.hpp"
#include "topoloc/live/lcm_publisher.hpp"
#include "topoloc/live/recorder.hpp"
#include "topoloc/map/map_file.hpp"
#include "topoloc/realtime/memory_lock.hpp"
#include "topoloc/transport/lcm_connection.hpp"

#include "live/cpu_affinity.hpp"
#include "live/stop_event.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/core.h>

namespace topoloc::live {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kRecordedMatchSets = 16;
constexpr std::size_t kHeapReserveBytes = 32U << 20;

/// CAN frames from the bus.
class BusSource : public CanSource {
 public:
  BusSource(const can::VehicleSignals& signals, const config::LiveConfig& live)
      : receiver_(can::can_inputs(signals, live.can_interfaces),
                  {.frames_per_call = kMaxFramesPerTick, .buffer_bytes = live.can_buffer_bytes}) {}

  std::span<const can::Frame> receive() noexcept override { return receiver_.receive(); }
  void system_clock_set(std::int64_t by_ns) noexcept override { receiver_.system_clock_set(by_ns); }
  [[nodiscard]] can::CanCounters counters() const noexcept override { return receiver_.counters(); }

 private:
  can::CanReceiver receiver_;
};

realtime::ThreadConfig ordinary(const char* name, std::size_t stack_bytes = 1U << 20) {
  return {.name = name, .fifo_priority = 0, .cpus = {}, .stack_bytes = stack_bytes};
}

}  // namespace

struct LiveProcess::Impl {
  Impl(config::VehicleConfig vehicle_in, LiveOptions options_in)
      : vehicle(std::move(vehicle_in)),
        options(std::move(options_in)),
        signals(vehicle.can),
        bus(signals, vehicle.live),
        loop({.estimator =
                  options.map ? vehicle.estimator : estimation::without_map(vehicle.estimator),
              .journal = keeps_journal()},
             clock, signals, bus, ports),
        estimator({.rate_hz = vehicle.live.rate_hz,
                   .thread = {.name = "estimator",
                              .fifo_priority = vehicle.live.priority,
                              .cpus = estimator_cpus(),
                              .stack_bytes = 512 * 1024},
                   .wake_fd = wake.fd()},
                  loop),
        lcm_in(vehicle.live.lcm_url),
        lcm_out(vehicle.live.lcm_url) {
    transport::require_open(lcm_in, vehicle.live.lcm_url);
    transport::require_open(lcm_out, vehicle.live.lcm_url);
    if (vehicle.live.cpu) {
      // Before any further thread is made, those of ONNX Runtime and LCM among them.
      keep_off_cpu(*vehicle.live.cpu);
    }
    choose_start();
    warnings.insert(warnings.end(), estimator.warnings().begin(), estimator.warnings().end());
    realtime::keep_heap(kHeapReserveBytes);
    const realtime::MemoryLock lock = realtime::lock_memory();
    if (!lock.locked) {
      warnings.push_back(lock.warning);
    }
    open_map();
    make_recorder();
    make_matcher();
    make_threads();
  }

  [[nodiscard]] bool keeps_journal() const { return !vehicle.live.journal.empty(); }
  [[nodiscard]] std::vector<int> estimator_cpus() const {
    return vehicle.live.cpu ? std::vector<int>{*vehicle.live.cpu} : std::vector<int>{};
  }

  void choose_start() {
    if (options.initial_pose) {
      loop.start_from(*options.initial_pose);
    } else if (!vehicle.live.last_pose.empty()) {
      try {
        if (const auto last = read_last_pose(vehicle.live.last_pose)) {
          loop.start_from(last->T_world_imu);
        }
      } catch (const std::runtime_error& e) {  // a power cut while it was written
        warnings.push_back(fmt::format("{}: not started from", e.what()));
      }
    }
  }

  void make_recorder() {
    if (!keeps_journal()) {
      return;
    }
    recorded_sets.emplace(kRecordedMatchSets);
    recorder.emplace(
        Recorder::Config{.folder = vehicle.live.journal,
                         .max_bytes = static_cast<std::size_t>(vehicle.live.journal_mb) << 20,
                         .origin = {.version = options.version,
                                    .vehicle_yaml = options.vehicle_yaml,
                                    .with_map = options.map.has_value()}},
        *recorded_sets, ports.journal);
  }

  void open_map() {
    if (!options.map) {
      return;
    }
    if (!vehicle.camera.configured()) {
      throw std::runtime_error("a map is given, but the vehicle has no camera (section 'camera')");
    }
    map.emplace(*options.map);
    const config::KalibrCamera& camera = vehicle.camera.kalibr;
    map_matcher.emplace(vehicle.matching, *map, camera.calibration, camera.T_imu_cam,
                        drive::read_mask(vehicle.camera));
  }

  void make_matcher() {
    if (!map) {
      return;
    }
    const PinholeCamera& lens = vehicle.camera.kalibr.calibration.pinhole;
    matcher.emplace(
        MatchWorker::Config{.image_size = {lens.width_px, lens.height_px},
                            .budget_ns = std::llround(1e9 * vehicle.live.latency_budget_s)},
        clock,
        FrameMatcher{
            .match =
                [this](std::int64_t time_ns, const cv::Mat& grey,
                       const matching::PosePrediction& prediction, estimation::MapMatchSet& out,
                       matching::Effort effort) {
                  return map_matcher->match(time_ns, grey, prediction, out, effort);
                },
            .prefetch =
                [this](const RigidTransform& T_world_imu) { map_matcher->prefetch(T_world_imu); },
            .least_effort = map_matcher->least_effort()},
        frames, ports, recorded_sets ? &*recorded_sets : nullptr);
  }

  void make_threads() {
    const std::int64_t history_ns = std::llround(1e9 * vehicle.estimator.history.duration_s);
    receiver.emplace(LcmReceiver::Config{.camera = map ? vehicle.camera : config::CameraConfig{},
                                         .channels = vehicle.live.channels,
                                         .max_frame_age_ns = history_ns},
                     clock, lcm_in, frames, ports,
                     [this] { stop_requested.store(true, std::memory_order_release); });
    if (!vehicle.live.last_pose.empty()) {
      last_pose.emplace(vehicle.live.last_pose);
      last_pose_thread.emplace(ordinary("last-pose"), [this] {
        last_pose->run(stop_last_pose);
        last_pose_done.store(true, std::memory_order_release);
      });
    }
    publisher.emplace(
        LcmPublisher::Config{.channels = vehicle.live.channels,
                             .crs = map ? map->info().crs : std::string{},
                             .origin_m = map ? map->info().origin_m : Eigen::Vector3d::Zero(),
                             .last_pose = last_pose ? &*last_pose : nullptr},
        clock, lcm_out, ports.outputs, wake.fd(),
        [this](ProcessStatus& status) { collect(status); });
    receiver_thread.emplace(ordinary("lcm-receiver"), [this] {
      receiver->run(stop_receiver,
                    [this](const ReceiverStatus& status) { receiver_status.write(status); });
    });
    publisher_thread.emplace(ordinary("lcm-publisher"), [this] { publisher->run(stop_publisher); });
    if (recorder) {
      recorder_thread.emplace(ordinary("recorder"), [this] {
        recorder->run(stop_recorder);
        recorder_done.store(true, std::memory_order_release);
      });
    }
    if (matcher) {
      constexpr std::size_t kStackBytes = 8U << 20;  // OpenCV and ONNX Runtime
      matcher_thread.emplace(ordinary("matcher", kStackBytes), [this] {
        matcher->run([this](const MatcherStatus& status) { matcher_status.write(status); });
      });
    }
  }

  /// In the publisher's thread.
  void collect(ProcessStatus& status) {
    status.estimator = estimator.status();
    (void)matcher_status.update();
    status.matcher = matcher_status.read();
    (void)receiver_status.update();
    status.receiver = receiver_status.read();
    status.mailbox = frames.counts();
    status.can_before_start = can_before_start;
    status.publisher.journal_failed = recorder && recorder->failed() ? 1 : 0;
    status.publisher.last_pose_failed = last_pose ? last_pose->failed() : 0;
  }

  void start() {
    // Not before: a process that does not come to run must not push out the journal of a crash. A
    // flight recorder that is missing is no reason not to drive.
    if (const std::string why = recorder ? recorder->open() : std::string{}; !why.empty()) {
      warnings.push_back(why + "; nothing is recorded");
    }
    // What the bus brought while models and map were read is old: a pose given as that of now must
    // not meet it.
    constexpr int kMostCalls = 1000;
    for (int i = 0; i < kMostCalls; ++i) {
      const std::size_t count = bus.receive().size();
      if (count == 0) {
        break;
      }
      can_before_start += count;
    }
    publisher_thread->start();
    for (auto* thread : {&recorder_thread, &last_pose_thread, &matcher_thread}) {
      if (*thread) {
        (*thread)->start();
      }
    }
    estimator.start();
    receiver_thread->start();
    started = true;
  }

  bool stop() {
    if (!started || stopped) {
      return true;
    }
    stopped = true;
    // Sources first, so that nothing that was taken in is lost on its way out.
    stop_receiver.set();
    frames.close();
    estimator.stop();
    stop_recorder.set();
    receiver_thread->join();
    stop_publisher.set();
    publisher_thread->join();
    stop_last_pose.set();
    const auto ended = [](const std::optional<realtime::Thread>& thread,
                          const std::atomic<bool>& done) {
      return !thread || done.load(std::memory_order_acquire);
    };
    const auto written = [&] {
      return ended(recorder_thread, recorder_done) && ended(last_pose_thread, last_pose_done);
    };
    for (int ms = 0; ms < 2000 && !written(); ++ms) {
      std::this_thread::sleep_for(1ms);
    }
    return written();
  }

  config::VehicleConfig vehicle;
  LiveOptions options;
  std::vector<std::string> warnings;
  const HostClock clock;
  WakeEvent wake;
  EstimatorPorts ports;
  realtime::Mailbox<CameraFrame> frames;
  can::VehicleSignals signals;
  BusSource bus;
  EstimatorLoop loop;
  EstimatorThread estimator;
  lcm::LCM lcm_in;
  lcm::LCM lcm_out;
  std::optional<realtime::SpscRing<NumberedMatchSet>> recorded_sets;
  std::optional<Recorder> recorder;
  std::optional<map::MapFile> map;
  std::optional<matching::MapMatcher> map_matcher;
  std::optional<MatchWorker> matcher;
  std::optional<LcmReceiver> receiver;
  std::optional<LastPoseKeeper> last_pose;
  std::optional<LcmPublisher> publisher;
  realtime::TripleBuffer<MatcherStatus> matcher_status;
  realtime::TripleBuffer<ReceiverStatus> receiver_status;
  std::atomic<bool> stop_requested{false};
  StopEvent stop_receiver;
  StopEvent stop_publisher;
  StopEvent stop_recorder;
  StopEvent stop_last_pose;
  std::atomic<bool> recorder_done{false};
  std::atomic<bool> last_pose_done{false};
  std::uint64_t can_before_start = 0;
  bool started = false;
  bool stopped = false;
  // Last: they run on the members above.
  std::optional<realtime::Thread> receiver_thread;
  std::optional<realtime::Thread> publisher_thread;
  std::optional<realtime::Thread> recorder_thread;
  std::optional<realtime::Thread> last_pose_thread;
  std::optional<realtime::Thread> matcher_thread;
};

LiveProcess::LiveProcess(config::VehicleConfig vehicle, LiveOptions options)
    : impl_(std::make_unique<Impl>(std::move(vehicle), std::move(options))) {}
LiveProcess::~LiveProcess() { impl_->stop(); }

const std::vector<std::string>& LiveProcess::warnings() const { return impl_->warnings; }
void LiveProcess::start() { impl_->start(); }
bool LiveProcess::stop() { return impl_->stop(); }
bool LiveProcess::stop_requested() const {
  return impl_->stop_requested.load(std::memory_order_acquire);
}
std::uint64_t LiveProcess::ticks() const { return impl_->estimator.ticks(); }
const ProcessStatus& LiveProcess::last_status() const { return impl_->publisher->status(); }

}  // namespace topoloc::live

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/status_message.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/core.h>

namespace topoloc::live {
namespace {

/// Appends counters whose names begin alike.
class CounterList {
 public:
  explicit CounterList(status_t& message) : message_(message) { message_.counters.clear(); }
  ~CounterList() { message_.ncounters = static_cast<std::int32_t>(message_.counters.size()); }
  CounterList(const CounterList&) = delete;
  CounterList& operator=(const CounterList&) = delete;

  void add(std::string_view name, std::uint64_t value) {
    counter_t& counter = message_.counters.emplace_back();
    counter.name = name;
    std::ranges::replace(counter.name, ' ', '_');
    counter.value = static_cast<std::int64_t>(value);
  }

  /// One for each value of an enum that counts by it; `begin`: the first to be listed.
  template <typename Enum, std::size_t kCount, typename Name>
  void add_each(std::string_view prefix, const std::array<std::uint64_t, kCount>& counts,
                const Name& name, std::size_t begin = 0) {
    for (std::size_t i = begin; i < kCount; ++i) {
      add(fmt::format("{}.{}", prefix, name(static_cast<Enum>(i))), counts[i]);
    }
  }

 private:
  status_t& message_;
};

constexpr std::array<std::pair<std::uint32_t, const char*>, 7> kReasons{
    {{estimation::reason::kNoImu, "no IMU data"},
     {estimation::reason::kImuGap, "gap in the IMU data"},
     {estimation::reason::kNoSpeed, "no wheel speed"},
     {estimation::reason::kNoMapFix, "no recent map fix"},
     {estimation::reason::kMapContradicts, "map and prediction disagree"},
     {estimation::reason::kUncertain, "position uncertain"},
     {estimation::reason::kNoPose, "waits for an initial pose"}}};

std::string words(const estimation::Estimate& estimate) {
  std::string text = estimation::name(estimate.mode);
  const char* separator = ": ";
  for (const auto& [bit, reason] : kReasons) {
    if ((estimate.reasons & bit) != 0U) {
      text += std::exchange(separator, ", ");
      text += reason;
    }
  }
  return text;
}

std::uint64_t microseconds(double milliseconds) {
  return static_cast<std::uint64_t>(std::llround(std::max(0.0, 1e3 * milliseconds)));
}

latency_t latency(std::string_view stage, const realtime::LatencyHistogram& histogram) {
  const auto microseconds = [](std::int64_t ns) { return 1e-3 * static_cast<double>(ns); };
  const realtime::LatencySummary summary = histogram.summary();
  latency_t message;
  message.stage = stage;
  message.count = static_cast<std::int64_t>(summary.count);
  message.p50_us = microseconds(summary.p50_ns);
  message.p99_us = microseconds(summary.p99_ns);
  message.p999_us = microseconds(summary.p999_ns);
  message.max_us = microseconds(summary.max_ns);
  return message;
}

}  // namespace

void fill_status(const ProcessStatus& status, status_t& message) {
  const estimation::Estimate& estimate = status.newest.estimate;
  message.mode = static_cast<std::int8_t>(estimate.mode);
  message.reasons = static_cast<std::int32_t>(estimate.reasons);
  message.text = words(estimate);
  if (status.receiver.timing.steps > 0) {
    message.text +=
        fmt::format("; the camera's clock was set, its stamps are corrected by {:+.3f} s",
                    status.receiver.timing.correction_s);
  }
  constexpr double kDrift_ppm = 100.0;
  if (std::abs(status.receiver.timing.drift_ppm) > kDrift_ppm) {
    message.text += fmt::format("; the camera's clock drifts by {:+.0f} ppm",
                                -status.receiver.timing.drift_ppm);
  }
  if (status.publisher.journal_failed > 0) {
    message.text += "; the journal cannot be written, nothing is recorded";
  }

  CounterList list(message);
  const realtime::CycleStats& cycles = status.estimator.cycles;
  list.add("ticks.done", cycles.cycles);
  list.add("ticks.missed", cycles.missed);
  list.add("ticks.overruns", cycles.overruns);
  list.add("estimates.published", status.publisher.published);
  list.add("estimates.lost", status.estimator.loop.losses.outputs);
  list.add("messages.failed", status.publisher.publish_failed);
  list.add("messages.unreadable", status.receiver.lcm_failed);
  list.add("last_pose.failed", status.publisher.last_pose_failed);
  list.add("journal.lost_ticks", status.estimator.loop.losses.journal);
  list.add("journal.lost_match_sets", status.matcher.unrecorded);
  list.add("page_faults.minor", status.estimator.page_faults.minor);
  list.add("page_faults.major", status.estimator.page_faults.major);
  list.add("system_clock_steps", status.estimator.loop.system_clock_steps);

  for (const auto& [counter, member] : can::kCanCounters) {
    list.add(fmt::format("can.{}", counter), status.estimator.loop.can.*member);
  }
  list.add("can.before_start", status.can_before_start);
  list.add("can.over_tick", status.estimator.loop.over_tick);
  list.add_each<can::SignalReject>("signals", status.estimator.loop.signals,
                                   [](can::SignalReject why) { return can::name(why); });
  const can::SignalCounts& read = status.estimator.loop.signal_counts;
  list.add("signals.other_frames", read.other_frames);
  list.add("signals.used", read.used);
  list.add("signals.waiting", read.waiting);
  list.add("signals.imu_samples", read.imu_samples);
  list.add("signals.speed_samples", read.speed_samples);
  list.add("signals.lost_messages", status.estimator.loop.lost_messages);
  list.add("signals.clock_steps", status.estimator.loop.sensor_clock_steps);

  const estimation::Counters& c = estimate.counters;
  const auto verdict = [](estimation::InsertVerdict v) { return estimation::name(v); };
  list.add_each<estimation::InsertVerdict>("imu", c.imu, verdict);
  list.add_each<estimation::InsertVerdict>("speed", c.speed, verdict);
  list.add_each<estimation::InsertVerdict>("match_sets", c.matches, verdict);
  list.add("filter.starts", c.starts);
  list.add("filter.forgotten", c.forgotten);
  list.add("filter.initial_pose_rejected", c.initial_pose_rejected);
  list.add("filter.speed_unused", c.speed_unused);
  list.add("filter.speed_gate_rejected", c.speed_gate_rejected);
  list.add("filter.imu_gaps", c.imu_gaps);
  list.add("filter.doubts", c.doubts);
  list.add("filter.breakdowns", c.breakdowns);
  list.add_each<estimation::MapVerdict>(
      "map", c.map, [](estimation::MapVerdict v) { return estimation::name(v); });

  const ReceiverStatus& receiver = status.receiver;
  list.add_each<transport::ImageVerdict>(
      "images", receiver.images, [](transport::ImageVerdict v) { return transport::name(v); });
  list.add("images.wrong_size", receiver.wrong_size);
  list.add_each<FrameStamp>("frames", receiver.timing.stamps,
                            [](FrameStamp stamp) { return name(stamp); });
  list.add("frames.clock_steps", receiver.timing.steps);
  list.add("frames.late", receiver.timing.late);
  list.add("frames.delay_us", microseconds(receiver.timing.delay_ms));
  list.add("frames.overwritten", status.mailbox.overwritten);
  list.add("frames.discarded", status.mailbox.discarded);
  list.add("frames.answers_lost", status.estimator.loop.losses.predictions);
  list.add_each<FrameFate>("frames", status.matcher.frames,
                           [](FrameFate fate) { return name(fate); });
  list.add_each<matching::FrameVerdict>(
      "matching", status.matcher.verdicts,
      [](matching::FrameVerdict v) { return matching::to_string(v); });
  list.add("matching.damaged_nodes", status.matcher.damaged_nodes);
  list.add("matching.over_capacity", status.matcher.over_capacity);
  list.add("matching.over_budget", status.matcher.over_budget);
  list.add("matching.slowdowns", status.matcher.slowdowns);
  list.add("matching.effort", static_cast<std::uint64_t>(status.matcher.effort));
  list.add("commands.poses", receiver.poses);
  list.add("commands.bad_poses", receiver.bad_poses);
  list.add("commands.poses_lost", receiver.poses_lost);
  list.add("commands.bad", receiver.bad_commands);
}

void fill_timing(const ProcessStatus& status, timing_t& message) {
  message.stages = {latency("wake_up", status.estimator.cycles.wakeup_latency),
                    latency("tick", status.estimator.cycles.execution_time),
                    latency("publish", status.publisher.latency),
                    latency("features", status.matcher.extract),
                    latency("match", status.matcher.match),
                    latency("frame", status.matcher.total)};
  message.nstages = static_cast<std::int32_t>(message.stages.size());
}

}  // namespace topoloc::live

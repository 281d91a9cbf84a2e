// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/lcm_publisher.hpp"

#include "topoloc/live/messages.hpp"

#include "live/stop_event.hpp"

#include <sys/eventfd.h>
#include <utility>

namespace topoloc::live {
namespace {

constexpr std::int64_t kStatusPeriod_ns = 1'000'000'000;

}  // namespace

LcmPublisher::LcmPublisher(const Config& config, const HostClock& clock, lcm::LCM& lcm,
                           realtime::SpscRing<TickOutput>& outputs, int wake_fd, Collect collect)
    : config_(config),
      clock_(clock),
      start_ns_(clock.now_ns()),
      lcm_(lcm),
      outputs_(outputs),
      wake_fd_(wake_fd),
      collect_(std::move(collect)) {
  geo_pose_.crs = config.crs;
}

void LcmPublisher::run(const StopEvent& stop) {
  constexpr int kTimeout_ms = 50;
  std::int64_t next_status_ns = start_ns_ + kStatusPeriod_ns;
  while (true) {
    const bool stopping = stop.wait(kTimeout_ms, wake_fd_);
    eventfd_t ticks = 0;
    eventfd_read(wake_fd_, &ticks);
    publish_outputs();
    if (stopping && outputs_.size() == 0) {
      break;
    }
    if (clock_.now_ns() >= next_status_ns) {
      next_status_ns += kStatusPeriod_ns;
      publish_status(false);
    }
  }
  publish_status(true);
}

void LcmPublisher::publish_outputs() {
  constexpr int kMostInARound = 64;  // status goes out, too, when publishing is too slow
  for (int i = 0; i < kMostInARound; ++i) {
    const TickOutput* output = outputs_.read_slot();
    if (output == nullptr) {
      return;
    }
    publish(*output);
    status_.newest = *output;
    outputs_.commit_read();
  }
}

void LcmPublisher::publish(const TickOutput& output) {
  if (!config_.channels.estimate.empty()) {
    send(config_.channels.estimate, to_estimate(output));
  }
  if (has_pose(output)) {
    if (!config_.channels.pose.empty()) {
      send(config_.channels.pose, to_pose(output));
    }
    if (!config_.channels.geo_pose.empty() && !config_.crs.empty()) {
      fill_geo_pose(output, config_.origin_m, geo_pose_);
      send(config_.channels.geo_pose, geo_pose_);
    }
  }
  ++status_.publisher.published;
  status_.publisher.latency.record(clock_.now_ns() - output.now_ns);
}

void LcmPublisher::publish_status(bool stopping) {
  clock_.watch();
  collect_(status_);
  const std::int64_t now_ns = clock_.now_ns();
  const std::int64_t utime = (now_ns + clock_.system_offset_ns()) / 1000;
  if (!config_.channels.status.empty()) {
    fill_status(status_, status_message_);
    status_message_.utime = utime;
    status_message_.uptime_s = 1e-9 * static_cast<double>(now_ns - start_ns_);
    status_message_.stopping = static_cast<std::int8_t>(stopping ? 1 : 0);
    send(config_.channels.status, status_message_);
  }
  if (!config_.channels.timing.empty()) {
    fill_timing(status_, timing_message_);
    timing_message_.utime = utime;
    send(config_.channels.timing, timing_message_);
  }
  keep_last_pose();
}

void LcmPublisher::keep_last_pose() {
  if (config_.last_pose == nullptr) {
    return;
  }
  const estimation::Estimate& estimate = status_.newest.estimate;
  switch (judge_last_pose(status_.newest)) {
    case LastPoseVerdict::kKeep:
      config_.last_pose->keep(LastPose{estimate.time_ns + status_.newest.system_offset_ns,
                                       estimate.state.T_world_imu()});
      break;
    case LastPoseVerdict::kRemove:
      config_.last_pose->keep(std::nullopt);
      break;
    case LastPoseVerdict::kLeave:
      break;
  }
}

template <typename Message>
void LcmPublisher::send(const std::string& channel, const Message& message) {
  encoded_.resize(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(encoded_.data(), 0, static_cast<int>(encoded_.size()));
  if (lcm_.publish(channel, encoded_.data(), static_cast<unsigned>(encoded_.size())) != 0) {
    ++status_.publisher.publish_failed;
  }
}

}  // namespace topoloc::live

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/config/live_config.hpp"
#include "topoloc/live/host_clock.hpp"
#include "topoloc/live/last_pose.hpp"
#include "topoloc/live/status_message.hpp"
#include "topoloc/live/tick.hpp"
#include "topoloc/realtime/spsc_ring.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <topoloc/geo_pose_t.hpp>
#include <vector>

#include <lcm/lcm-cpp.hpp>

namespace topoloc::live {

class StopEvent;

/// Publishes what the estimator hands out, in a thread of its own: an estimate_t (and pose_t,
/// geo_pose_t) per tick, status and timing once a second. Encodes into one buffer.
class LcmPublisher {
 public:
  struct Config {
    config::LcmChannels channels;
    std::string crs;  ///< of the map; empty: no geo_pose_t
    Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
    LastPoseKeeper* last_pose = nullptr;  ///< gets it while tracking and standing; may be null
  };
  /// Fills in what the other threads have said of themselves.
  using Collect = std::function<void(ProcessStatus&)>;

  /// All references outlive this. `wake_fd`: eventfd of the estimator thread.
  LcmPublisher(const Config& config, const HostClock& clock, lcm::LCM& lcm,
               realtime::SpscRing<TickOutput>& outputs, int wake_fd, Collect collect);

  /// Until `stop` is set and the outputs that were there by then are out; ends with a last status.
  void run(const StopEvent& stop);

  [[nodiscard]] const ProcessStatus& status() const { return status_; }

 private:
  void publish_outputs();
  void publish(const TickOutput& output);
  void publish_status(bool stopping);
  void keep_last_pose();
  template <typename Message>
  void send(const std::string& channel, const Message& message);

  Config config_;
  HostClock clock_;
  std::int64_t start_ns_;
  lcm::LCM& lcm_;
  realtime::SpscRing<TickOutput>& outputs_;
  int wake_fd_;
  Collect collect_;
  ProcessStatus status_;
  geo_pose_t geo_pose_{};
  status_t status_message_{};
  timing_t timing_message_{};
  std::vector<std::byte> encoded_;
};

}  // namespace topoloc::live

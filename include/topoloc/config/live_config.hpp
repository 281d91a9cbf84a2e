// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace topoloc::config {

/// LCM channels of the vehicle process, but for the camera's (CameraConfig::channel). An empty name
/// turns an output off.
struct LcmChannels {
  std::string estimate = "TOPOLOC_ESTIMATE";
  std::string pose = "TOPOLOC_POSE";
  std::string geo_pose = "TOPOLOC_GEO_POSE";
  std::string status = "TOPOLOC_STATUS";
  std::string timing = "TOPOLOC_TIMING";
  std::string initial_pose = "TOPOLOC_INITIAL_POSE";  ///< in
  std::string command = "TOPOLOC_COMMAND";            ///< in
};

/// How the vehicle process runs (section `live` of vehicle.yaml).
struct LiveConfig {
  double rate_hz = 200.0;  ///< of the estimator
  int priority = 80;       ///< SCHED_FIFO, of the estimator thread; 0: none
  std::optional<int> cpu;  ///< that the estimator thread is pinned to, and the others keep off

  /// Opened where `can.imu`, `can.wheels` and `can.direction` name no interface.
  std::vector<std::string> can_interfaces{"can0"};
  int can_buffer_bytes = 1 << 20;

  std::string lcm_url = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4000000";
  LcmChannels channels;

  /// A frame's match set is to be with the estimator so long after it has come in.
  double latency_budget_s = 0.1;

  std::filesystem::path journal;    ///< folder of the flight recorder; empty: none
  int journal_mb = 256;             ///< it keeps at most so much
  std::filesystem::path last_pose;  ///< file that keeps the last good pose; empty: none
};

}  // namespace topoloc::config

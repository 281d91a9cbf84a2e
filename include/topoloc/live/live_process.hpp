// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/config/vehicle_config.hpp"
#include "topoloc/live/status_message.hpp"

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace topoloc::live {

struct LiveOptions {
  std::string vehicle_yaml;                    ///< text of the configuration, for the journal
  std::string version;                         ///< of the program, likewise
  std::optional<std::filesystem::path> map;    ///< without: dead reckoning
  std::optional<RigidTransform> initial_pose;  ///< else the last one kept, if there is one
};

/// The vehicle process: estimator, matcher, LCM receiver, publisher and recorder, each in its own
/// thread (docs/architecture.md).
class LiveProcess {
 public:
  /// Makes everything the threads need: reads DBC, models and map, opens LCM and CAN, allocates,
  /// locks memory, prefaults stacks. Throws std::runtime_error (and its kin) that says what is
  /// wrong. Block signals that shall end the process before: threads inherit that.
  LiveProcess(config::VehicleConfig vehicle, LiveOptions options);
  /// Stops it, and waits for all of its threads.
  ~LiveProcess();
  LiveProcess(const LiveProcess&) = delete;
  LiveProcess& operator=(const LiveProcess&) = delete;

  /// What the system denies and the process runs without: one line each. start() may add some.
  [[nodiscard]] const std::vector<std::string>& warnings() const;

  void start();
  /// Last estimates and a last status go out, the journal is closed. Takes some 10 ms, but for a
  /// disk that hangs: it is given 2 s. False: the end of the journal or the last pose is not
  /// written.
  ///
  /// The matcher may be in the middle of a frame even then. Nothing is wanted of it any more: where
  /// the program ends, std::_Exit() does not wait for it, nor for a disk, as the destructor does.
  [[nodiscard]] bool stop();

  /// An LCM command asked for the end.
  [[nodiscard]] bool stop_requested() const;
  /// Ticks so far: a watchdog sees by it whether the estimator lives.
  [[nodiscard]] std::uint64_t ticks() const;
  /// After stop(): as last published.
  [[nodiscard]] const ProcessStatus& last_status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace topoloc::live

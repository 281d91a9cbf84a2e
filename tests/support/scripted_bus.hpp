// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/candump.hpp"
#include "topoloc/config/vehicle_config.hpp"
#include "topoloc/live/can_source.hpp"
#include "topoloc/live/host_clock.hpp"
#include "topoloc/live/tick.hpp"

#include "support/drive_folder.hpp"
#include "support/temporary_folder.hpp"

#include <algorithm>
#include <span>
#include <vector>

namespace topoloc::live {

/// A car that drives along x at 10 m/s, as the frames of a bus: 100 samples a second.
class DrivenCar {
 public:
  static constexpr double kSpeed_mps = 10.0;
  static constexpr std::int64_t kPeriod_us = 10'000;

  explicit DrivenCar(int samples) {
    std::vector<testing::CanRow> rows;
    for (int i = 0; i < samples; ++i) {
      rows.push_back({.time_us = kPeriod_us * (i + 1), .speed_mps = kSpeed_mps});
    }
    folder.write_can_log(rows);
    can::CandumpReader log(folder / "can.log");
    can::Frame frame;
    while (log.next(frame)) {
      frames.push_back(frame);
    }
    vehicle = config::load_vehicle_config(folder / "vehicle.yaml");
  }

  testing::TemporaryFolder temporary;
  testing::DriveFolder folder{temporary / "drive", testing::tiny_camera()};
  std::vector<can::Frame> frames;  ///< stamps from zero
  config::VehicleConfig vehicle;
};

/// Hands out the frames of a car as their time comes, from the start of the clock's second on.
class ScriptedBus : public CanSource {
 public:
  ScriptedBus(const DrivenCar& car, const HostClock& clock) : clock_(clock), frames_(car.frames) {
    const std::int64_t start_ns = clock_.now_ns();
    for (can::Frame& frame : frames_) {
      frame.time_ns += start_ns;
    }
  }

  std::span<const can::Frame> receive() noexcept override {
    const std::size_t begin = next_;
    const std::int64_t now_ns = clock_.now_ns();
    while (next_ < frames_.size() && next_ - begin < kMaxFramesPerTick &&
           frames_[next_].time_ns <= now_ns) {
      ++next_;
    }
    counters_.frames += next_ - begin;
    return std::span(frames_).subspan(begin, next_ - begin);
  }
  void system_clock_set(std::int64_t /*by_ns*/) noexcept override {}  // its stamps are HostClock's
  [[nodiscard]] can::CanCounters counters() const noexcept override { return counters_; }

 private:
  HostClock clock_;
  std::vector<can::Frame> frames_;
  std::size_t next_ = 0;
  can::CanCounters counters_;
};

}  // namespace topoloc::live

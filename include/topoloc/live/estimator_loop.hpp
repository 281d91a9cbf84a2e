// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/vehicle_signals.hpp"
#include "topoloc/live/can_source.hpp"
#include "topoloc/live/host_clock.hpp"
#include "topoloc/live/tick.hpp"
#include "topoloc/matching/predicted_camera.hpp"
#include "topoloc/realtime/spsc_ring.hpp"

#include <array>
#include <cstdint>
#include <optional>

namespace topoloc::live {

/// What the matcher wants to know: where the vehicle was at a frame's time.
struct FramePrediction {
  std::int64_t time_ns = 0;
  bool known = false;  ///< false: the filter does not run, or the time is older than its history
  matching::PosePrediction pose;
  Eigen::Vector3d v_world_mps = Eigen::Vector3d::Zero();
};

/// A pose from outside. Without a time: the vehicle is there now, and stays until the filter has
/// started from it.
struct GivenPose {
  std::optional<std::int64_t> time_ns;  ///< on the HostClock's line
  RigidTransform T_world_imu;
};

/// All that the estimator thread shares with other threads. One thread at each end of each ring.
struct EstimatorPorts {
  static constexpr std::size_t kTicks = 256;  ///< that a stalled reader may miss: over 1 s

  realtime::SpscRing<GivenPose> poses{4};              ///< from the receiver
  realtime::SpscRing<std::int64_t> asked{8};           ///< from the matcher: frame times
  realtime::SpscRing<FramePrediction> predictions{8};  ///< to the matcher: the answers
  realtime::SpscRing<NumberedMatchSet> match_sets{4};  ///< from the matcher
  realtime::SpscRing<TickOutput> outputs{kTicks};      ///< to the publisher
  realtime::SpscRing<RecordedTick> journal{kTicks};    ///< to the recorder
};

/// What the estimator thread could not hand on, because the reader was too slow.
struct EstimatorLosses {
  std::uint64_t outputs = 0;
  std::uint64_t journal = 0;
  std::uint64_t predictions = 0;
};

/// How the estimator thread's inputs and outputs are doing, since the start.
struct EstimatorStatus {
  EstimatorLosses losses;
  can::CanCounters can;
  std::array<std::uint64_t, can::kSignalRejectCount> signals{};  ///< by can::SignalReject
  can::SignalCounts signal_counts;
  std::uint64_t lost_messages = 0;       ///< by the counters of CAN messages
  std::uint64_t sensor_clock_steps = 0;  ///< times that the clock of IMU or wheels was set
  std::uint64_t system_clock_steps = 0;  ///< times that the system clock was
  std::uint64_t over_tick = 0;           ///< CAN frames beyond those that a tick can take, lost
};

/// One tick of the estimator thread: takes what has come in from bus and rings, runs the
/// estimator, hands on what came out. All memory exists once it is constructed; tick() does not
/// allocate, lock, block or throw, and its work is bounded: kMaxFramesPerTick frames, one match
/// set, and the history gone over as often.
class EstimatorLoop {
 public:
  struct Config {
    estimation::EstimatorConfig estimator;
    bool journal = false;
  };

  /// All references outlive this. `signals` and `can` are used by tick() alone from now on.
  EstimatorLoop(const Config& config, const HostClock& clock, can::VehicleSignals& signals,
                CanSource& can, EstimatorPorts& ports);

  /// To be called before the first tick.
  void start_from(const RigidTransform& T_world_imu) { given_ = {std::nullopt, T_world_imu}; }

  const TickOutput& tick(std::uint64_t number);

  /// For the thread that ticks.
  void report(EstimatorStatus& status) const;

 private:
  void take_can();
  void take_pose();
  void answer();
  void record(const TickOutput& output);

  bool keeps_journal_;
  HostClock clock_;
  can::VehicleSignals& signals_;
  CanSource& can_;
  EstimatorPorts& ports_;
  std::int64_t offset_before_ns_ = 0;  ///< HostClock::system_offset_ns() of the tick before
  TickInput input_;
  TickRunner runner_;
  std::optional<GivenPose> given_;  ///< not yet started from
  std::uint64_t starts_when_given_ = 0;
  std::uint64_t over_tick_ = 0;
  EstimatorLosses losses_;
};

}  // namespace topoloc::live

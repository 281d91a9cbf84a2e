// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/estimator_loop.hpp"

#include <algorithm>

namespace topoloc::live {

EstimatorLoop::EstimatorLoop(const Config& config, const HostClock& clock,
                             can::VehicleSignals& signals, CanSource& can, EstimatorPorts& ports)
    : keeps_journal_(config.journal),
      clock_(clock),
      signals_(signals),
      can_(can),
      ports_(ports),
      runner_(config.estimator) {}

const TickOutput& EstimatorLoop::tick(std::uint64_t number) {
  offset_before_ns_ = clock_.system_offset_ns();
  clock_.watch();
  if (clock_.system_offset_ns() != offset_before_ns_) {
    can_.system_clock_set(clock_.system_offset_ns() - offset_before_ns_);
  }
  input_.tick = number;
  input_.now_ns = clock_.now_ns();
  input_.system_offset_ns = clock_.system_offset_ns();
  take_can();
  take_pose();
  const NumberedMatchSet* matches = ports_.match_sets.read_slot();
  input_.match_set.reset();
  if (matches != nullptr) {
    input_.match_set = matches->number;
  }
  const TickOutput& output = runner_.run(input_, matches != nullptr ? &matches->set : nullptr);
  if (matches != nullptr) {
    ports_.match_sets.commit_read();
  }
  answer();
  losses_.outputs += ports_.outputs.try_push(output) ? 0 : 1;
  if (keeps_journal_) {
    record(output);
  }
  return output;
}

void EstimatorLoop::take_can() {
  input_.imu_count = 0;
  input_.speed_count = 0;
  const std::span<const can::Frame> frames = can_.receive();
  const std::size_t count = std::min(frames.size(), kMaxFramesPerTick);
  over_tick_ += frames.size() - count;
  for (std::size_t i = 0; i < count; ++i) {
    can::Frame frame = frames[i];
    const std::int64_t stamp_ns = frame.time_ns;
    frame.time_ns = clock_.from_system(stamp_ns);
    if (frame.time_ns > input_.now_ns) {  // it came before the clock was set back
      frame.time_ns = stamp_ns - offset_before_ns_;
    }
    const can::VehicleSamples samples = signals_.feed(frame);
    if (samples.imu) {
      input_.imu[input_.imu_count++] = *samples.imu;
    }
    if (samples.speed) {
      input_.speed[input_.speed_count++] = *samples.speed;
    }
  }
}

void EstimatorLoop::take_pose() {
  input_.initial_pose.reset();
  const std::uint64_t starts = runner_.estimator().counters().starts;
  GivenPose newer;
  while (ports_.poses.try_pop(newer)) {
    given_ = newer;
    starts_when_given_ = starts;
  }
  if (!given_) {
    return;
  }
  if (given_->time_ns) {
    input_.initial_pose = {.time_ns = *given_->time_ns, .T_world_imu = given_->T_world_imu};
    given_.reset();
  } else if (starts > starts_when_given_) {
    given_.reset();
  } else if (input_.imu_count > 0) {
    // Offered with each inertial sample until there is a speed, too, and the filter starts.
    input_.initial_pose = {.time_ns = input_.imu[0].time_ns, .T_world_imu = given_->T_world_imu};
  }
}

void EstimatorLoop::answer() {
  std::int64_t time_ns = 0;
  // One a tick: the matcher works on one frame at a time.
  if (!ports_.asked.try_pop(time_ns)) {
    return;
  }
  FramePrediction prediction{.time_ns = time_ns, .pose = {}};
  estimation::Covariance P;
  if (const auto state = runner_.estimator().state_at(time_ns, P)) {
    prediction.known = true;
    prediction.pose = {state->T_world_imu(), P.topLeftCorner<6, 6>()};
    prediction.v_world_mps = state->v_world_imu;
  }
  losses_.predictions += ports_.predictions.try_push(prediction) ? 0 : 1;
}

void EstimatorLoop::record(const TickOutput& output) {
  RecordedTick* const slot = ports_.journal.write_slot();
  if (slot == nullptr) {
    ++losses_.journal;
    return;
  }
  input_.lost_before = losses_.journal;
  slot->input = input_;
  slot->pose.reset();
  if (output.estimate.mode != estimation::Mode::kUninitialised) {
    slot->pose = {.time_ns = output.estimate.time_ns,
                  .T_world_imu = output.estimate.state.T_world_imu()};
  }
  ports_.journal.commit_write();
}

void EstimatorLoop::report(EstimatorStatus& status) const {
  status.losses = losses_;
  status.can = can_.counters();
  for (std::size_t i = 0; i < status.signals.size(); ++i) {
    status.signals[i] = signals_.rejected(static_cast<can::SignalReject>(i));
  }
  status.signal_counts = signals_.counts();
  status.lost_messages = signals_.lost_messages();
  status.sensor_clock_steps = signals_.new_time_lines();
  status.system_clock_steps = clock_.steps();
  status.over_tick = over_tick_;
}

}  // namespace topoloc::live

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/replay/can_faults.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace topoloc::replay {
namespace {

bool concerns(const Fault& fault, const can::Frame& frame) {
  const can::FrameId id = {frame.id, frame.extended};
  return frame.kind == can::FrameKind::kData &&
         (fault.interface.empty() || fault.interface == frame.interface()) &&
         (fault.ids.empty() ||
          std::find(fault.ids.begin(), fault.ids.end(), id) != fault.ids.end());
}

void flip_bits(FaultChoice& choice, int count, can::Frame& frame) {
  if (frame.length == 0) {
    return;
  }
  for (int i = 0; i < count; ++i) {
    const std::uint64_t bit = choice.below(std::uint64_t{8} * frame.length);
    frame.data[bit / 8] = static_cast<std::uint8_t>(frame.data[bit / 8] ^ 1U << bit % 8);
  }
}

bool is_of(const can::SignalRef& ref, const can::Frame& frame) {
  return ref.message->id == frame.id && ref.message->extended == frame.extended &&
         can::is_present(*ref.message, *ref.signal, frame.payload());
}

void scale(const can::SignalRef& ref, double factor, can::Frame& frame) {
  const auto value = can::decode(ref.signal->coding, frame.payload());
  if (!value) {
    return;
  }
  double scaled = *value * factor;
  if (ref.signal->has_limits()) {
    scaled = std::clamp(scaled, ref.signal->minimum, ref.signal->maximum);
  }
  can::encode(ref.signal->coding, scaled, std::span(frame.data).first(frame.length));
}

}  // namespace

CanFaults::CanFaults(const FaultScript& script)
    : script_(&script), affected_(script.faults.size()) {
  for (std::size_t i = 0; i < script.faults.size(); ++i) {
    states_.push_back({.fault = &script.faults[i],
                       .choice = {script.seed, i},
                       .last = {},
                       .held = {},
                       .overtaken = std::nullopt});
  }
}

void CanFaults::push(const TimedFrame& frame, std::vector<TimedFrame>& out) {
  last_ns_ = frame.elapsed_ns;
  release_held(frame.elapsed_ns, out);
  run(0, frame, out);
}

void CanFaults::run(std::size_t from, const TimedFrame& timed, std::vector<TimedFrame>& out) {
  TimedFrame current = timed;
  for (std::size_t i = from; i < states_.size(); ++i) {
    State& state = states_[i];
    const Fault& fault = *state.fault;
    if (state.overtaken) {
      run(i + 1, current, out);
      if (--state.overtaken->by <= 0) {
        let_go(i, current.elapsed_ns, out);
      }
      return;
    }
    if (concerns_camera(fault.kind) || !concerns(fault, current.frame)) {
      continue;
    }
    const bool active = fault.active(current.elapsed_ns);
    if (fault.kind == FaultKind::kCanFrozen) {
      freeze(state, active, current.frame, affected_[i]);
      continue;
    }
    if (!active || !state.choice.takes(fault.share)) {
      continue;
    }
    ++affected_[i];
    switch (fault.kind) {
      case FaultKind::kCanDropout:
        return;
      case FaultKind::kCanBurst:
        state.held.push_back(current);
        return;
      case FaultKind::kCanReorder:
        state.overtaken = {.frame = current, .by = fault.count};
        return;
      case FaultKind::kCanBitErrors:
        flip_bits(state.choice, fault.count, current.frame);
        break;
      case FaultKind::kCanDuplicate:
        run(i + 1, current, out);
        break;
      case FaultKind::kWheelSlip:
        for (const can::SignalRef& ref : fault.signals) {
          if (is_of(ref, current.frame)) {
            scale(ref, fault.factor, current.frame);
          }
        }
        seal(current.frame);
        break;
      default:
        break;
    }
  }
  out.push_back(current);
}

void CanFaults::let_go(std::size_t index, std::int64_t elapsed_ns, std::vector<TimedFrame>& out) {
  TimedFrame frame = states_[index].overtaken->frame;
  states_[index].overtaken.reset();
  frame.elapsed_ns = elapsed_ns;
  run(index + 1, frame, out);
}

void CanFaults::release_held(std::int64_t elapsed_ns, std::vector<TimedFrame>& out) {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const Fault& fault = *states_[i].fault;
    if (states_[i].held.empty() || elapsed_ns < fault.until_ns) {
      continue;
    }
    const std::vector<TimedFrame> held = std::exchange(states_[i].held, {});
    for (TimedFrame frame : held) {
      frame.elapsed_ns = fault.until_ns;
      run(i + 1, frame, out);
    }
  }
}

void CanFaults::freeze(State& state, bool active, can::Frame& frame, std::uint64_t& affected) {
  const std::pair<std::string, can::FrameId> key = {std::string(frame.interface()),
                                                    {frame.id, frame.extended}};
  const auto [last, is_first] = state.last.try_emplace(key, frame.data);
  if (!active) {
    last->second = frame.data;
    return;
  }
  ++affected;
  if (state.fault->signals.empty()) {
    frame.data = last->second;
    return;
  }
  const auto frozen = std::span<const std::uint8_t>(last->second).first(frame.length);
  for (const can::SignalRef& ref : state.fault->signals) {
    if (is_of(ref, frame)) {
      if (const auto value = can::decode(ref.signal->coding, frozen)) {
        can::encode(ref.signal->coding, *value, std::span(frame.data).first(frame.length));
      }
    }
  }
  seal(frame);
}

void CanFaults::seal(can::Frame& frame) const {
  for (const can::MessageCheck& check : script_->checks) {
    if (check.concerns(frame)) {
      check.seal(frame);
    }
  }
}

void CanFaults::finish(std::vector<TimedFrame>& out) {
  for (const State& state : states_) {
    last_ns_ = std::max(last_ns_, state.held.empty() ? 0 : state.fault->until_ns);
  }
  release_held(last_ns_, out);
  for (std::size_t i = 0; i < states_.size(); ++i) {
    if (states_[i].overtaken) {
      let_go(i, last_ns_, out);
    }
  }
}

}  // namespace topoloc::replay

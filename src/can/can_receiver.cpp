// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/can_receiver.hpp"

#include "topoloc/can/vehicle_signals.hpp"

#include "can/can_socket.hpp"
#include "can/frame_merge.hpp"

#include <algorithm>
#include <ctime>
#include <stdexcept>

namespace topoloc::can {
namespace {

std::int64_t unix_now_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace

std::string_view name(CanState state) {
  constexpr std::array<std::string_view, 3> kNames = {"up", "down", "gone"};
  return kNames[static_cast<std::size_t>(state)];
}

std::vector<CanInput> can_inputs(const VehicleSignals& signals,
                                 const std::vector<std::string>& devices) {
  if (devices.empty()) {
    throw std::invalid_argument("no CAN interface is given");
  }
  std::vector<CanInput> inputs;
  for (const std::string& text : devices) {
    const std::size_t equals = text.find('=');
    CanInput input;
    input.interface = text.substr(0, equals);
    input.device = equals == std::string::npos ? text : text.substr(equals + 1);
    const bool twice = std::any_of(inputs.begin(), inputs.end(), [&](const CanInput& other) {
      return other.device == input.device || other.interface == input.interface;
    });
    if (twice || input.device.empty() || input.interface.empty()) {
      throw std::invalid_argument("CAN interface '" + text + "': " +
                                  (twice ? "is given twice" : "expected NAME or NAME=DEVICE"));
    }
    inputs.push_back(std::move(input));
  }
  for (const UsedMessage& used : signals.used_messages()) {
    bool known = false;
    for (CanInput& input : inputs) {
      if (used.interface.empty() || used.interface == input.interface) {
        input.ids.push_back(used.id);
        known = true;
      }
    }
    if (!known) {
      throw std::invalid_argument("signals come on CAN interface '" + used.interface +
                                  "', which is not among those given: add " + used.interface +
                                  " or " + used.interface + "=DEVICE");
    }
  }
  // Nothing configured: no filter would mean all frames.
  std::erase_if(inputs, [](const CanInput& input) { return input.ids.empty(); });
  return inputs;
}

struct CanReceiver::Impl {
  std::vector<std::unique_ptr<CanSocket>> sockets;
  std::vector<FrameQueue> queues;  ///< one for each socket
  std::vector<Frame> out;
};

CanReceiver::CanReceiver(const std::vector<CanInput>& inputs, const CanReceiverOptions& options)
    : impl_(std::make_unique<Impl>()) {
  if (inputs.empty() || options.frames_per_call == 0) {
    throw std::invalid_argument("CAN receiver: no interface, or no room for a frame");
  }
  for (const CanInput& input : inputs) {
    impl_->sockets.push_back(std::make_unique<CanSocket>(input, options));
    impl_->queues.emplace_back(options.frames_per_call);
  }
  impl_->out.resize(options.frames_per_call);
}

CanReceiver::~CanReceiver() = default;
CanReceiver::CanReceiver(CanReceiver&&) noexcept = default;
CanReceiver& CanReceiver::operator=(CanReceiver&&) noexcept = default;

std::span<const Frame> CanReceiver::receive() noexcept {
  const std::int64_t now_ns = unix_now_ns();
  for (std::size_t i = 0; i < impl_->sockets.size(); ++i) {
    FrameQueue& queue = impl_->queues[i];
    const auto [count, cut_short] = impl_->sockets[i]->read(queue.make_room(), now_ns);
    queue.add(count);
    queue.cut_short = cut_short;
  }
  const std::size_t count = merge(impl_->queues, now_ns, impl_->out);
  for (std::size_t i = 0; i < impl_->sockets.size(); ++i) {
    impl_->sockets[i]->counters().frames = impl_->queues[i].handed_out();
  }
  return std::span(impl_->out).first(count);
}

void CanReceiver::system_clock_set(std::int64_t by_ns) noexcept {
  for (const auto& socket : impl_->sockets) {
    socket->system_clock_set(by_ns);
  }
}

std::size_t CanReceiver::interface_count() const { return impl_->sockets.size(); }

const std::string& CanReceiver::device(std::size_t index) const {
  return impl_->sockets.at(index)->device();
}

CanState CanReceiver::state(std::size_t index) const { return impl_->sockets.at(index)->state(); }

const CanCounters& CanReceiver::counters(std::size_t index) const {
  return impl_->sockets.at(index)->counters();
}

CanCounters CanReceiver::counters() const {
  CanCounters sum;
  for (const auto& socket : impl_->sockets) {
    sum += socket->counters();
  }
  return sum;
}

int CanReceiver::buffer_bytes(std::size_t index) const {
  return impl_->sockets.at(index)->buffer_bytes();
}

}  // namespace topoloc::can

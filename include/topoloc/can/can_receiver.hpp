// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/can_counters.hpp"
#include "topoloc/can/frame.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace topoloc::can {

class VehicleSignals;

/// One interface to read from.
struct CanInput {
  std::string device;  ///< name in the system, "can0"
  /// The name that its frames shall carry, as vehicle.yaml has it; empty: the same. So a vehicle's
  /// configuration serves on a bench with other interfaces.
  std::string interface = {};
  std::vector<FrameId> ids = {};  ///< all others are filtered out in the kernel; empty: none are
};

/// The inputs that a vehicle's signals need. Each device is "can0" or, where vehicle.yaml has
/// another name for it, "can0=vcan0" (the name there first). Throws std::invalid_argument where a
/// signal's interface is not among the devices, a device is there twice, or none is given.
std::vector<CanInput> can_inputs(const VehicleSignals& signals,
                                 const std::vector<std::string>& devices);

struct CanReceiverOptions {
  std::size_t frames_per_call = 256;              ///< most that one receive() hands out
  int buffer_bytes = 1 << 20;                     ///< receive buffer asked for, of each socket
  std::int64_t rebind_interval_ns = 100'000'000;  ///< between looks at an interface that is away
};

enum class CanState : std::uint8_t {
  kUp,
  kDown,  ///< there, but set down (or without its bit rate): frames come once it is up
  kGone,  ///< deleted or unplugged: bound anew once it is there
};
std::string_view name(CanState state);

/// Frames from one or several CAN interfaces in the order of their time stamps: when they were
/// received according to the controller where it tells (mapped to Unix time), else the kernel.
/// Interfaces may go down, vanish and come back at any time.
class CanReceiver {
 public:
  /// Throws std::runtime_error that names the interface and says what to do.
  explicit CanReceiver(const std::vector<CanInput>& inputs, const CanReceiverOptions& options = {});
  ~CanReceiver();
  CanReceiver(CanReceiver&&) noexcept;
  CanReceiver& operator=(CanReceiver&&) noexcept;

  /// What has arrived; valid until the next call. Never blocks, allocates or throws, and makes at
  /// most 8 system calls per interface. Frames that arrive during the call on an interface read
  /// before may stay for the next one, so that the order holds.
  std::span<const Frame> receive() noexcept;

  /// The system clock was set, by so much ahead: time stamps of controllers follow. To be called
  /// before the next receive().
  void system_clock_set(std::int64_t by_ns) noexcept;

  [[nodiscard]] std::size_t interface_count() const;
  [[nodiscard]] const std::string& device(std::size_t index) const;
  [[nodiscard]] CanState state(std::size_t index) const;
  [[nodiscard]] const CanCounters& counters(std::size_t index) const;
  /// Of all interfaces together.
  [[nodiscard]] CanCounters counters() const;
  /// The receive buffer that the kernel granted, in the unit of CanReceiverOptions::buffer_bytes.
  /// The kernel's bookkeeping counts: expect a frame to take some 800 bytes.
  [[nodiscard]] int buffer_bytes(std::size_t index) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace topoloc::can

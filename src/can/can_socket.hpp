// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/can_receiver.hpp"
#include "topoloc/can/hardware_clock.hpp"

#include "can/raw_socket.hpp"

#include <array>
#include <span>
#include <string>
#include <sys/socket.h>
#include <vector>

namespace topoloc::can {

/// The receiving end of one CAN interface.
class CanSocket {
 public:
  /// Throws as CanReceiver does.
  CanSocket(const CanInput& input, const CanReceiverOptions& options);
  CanSocket(const CanSocket&) = delete;
  CanSocket& operator=(const CanSocket&) = delete;

  struct Read {
    std::size_t frames = 0;
    bool cut_short = false;  ///< there may be more
  };
  /// Fills `out` with what waits in the kernel; `now_ns` is the time, Unix. Neither blocks,
  /// allocates nor throws; at most 8 system calls.
  Read read(std::span<Frame> out, std::int64_t now_ns) noexcept;

  /// As HardwareClock's.
  void system_clock_set(std::int64_t by_ns) noexcept { hardware_clock_.system_clock_set(by_ns); }

  [[nodiscard]] const std::string& device() const { return device_; }
  [[nodiscard]] CanState state() const { return state_; }
  [[nodiscard]] const CanCounters& counters() const { return counters_; }
  [[nodiscard]] CanCounters& counters() { return counters_; }
  [[nodiscard]] int buffer_bytes() const { return buffer_bytes_; }

 private:
  /// Room for the time stamps (three timespec) and the drop counter that come with a frame.
  struct alignas(8) Control {
    std::array<std::byte, 128> bytes;
  };
  struct Stamps {
    std::int64_t software_ns = 0;
    std::int64_t hardware_ns = 0;
  };

  void make_filters(const CanInput& input);
  bool set_filters() noexcept;
  void set_buffer(int bytes);
  void request_stamps();
  void look_after_interface(std::int64_t now_ns) noexcept;
  void note_error(int error, std::int64_t now_ns) noexcept;
  void count_error_frame(const canfd_frame& frame) noexcept;
  Stamps read_control(msghdr& header) noexcept;
  bool take(std::size_t index, std::int64_t now_ns, Frame& frame) noexcept;

  std::string device_;
  std::array<char, kMaxInterfaceNameBytes + 1> frames_interface_{};
  Descriptor socket_;
  CanState state_ = CanState::kUp;
  std::int64_t rebind_interval_ns_;
  std::int64_t next_look_ns_ = 0;
  int buffer_bytes_ = 0;
  std::uint32_t kernel_drops_ = 0;
  HardwareClock hardware_clock_;
  CanCounters counters_;

  std::vector<can_filter> filters_;
  std::vector<canfd_frame> payloads_;
  std::vector<iovec> vectors_;
  std::vector<Control> controls_;
  std::vector<mmsghdr> headers_;
};

}  // namespace topoloc::can

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/frame.hpp"

#include <linux/can.h>
#include <optional>
#include <string>

/// What receiver and sender share of SocketCAN.
namespace topoloc::can {

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor();
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int number() const { return number_; }
  /// Gives it to the caller.
  int release();

 private:
  int number_;
};

/// Throws std::runtime_error "CAN interface 'DEVICE': WHAT".
[[noreturn]] void fail_on(const std::string& device, const std::string& what);

/// A raw CAN socket, not bound yet, that takes CAN FD. Throws std::runtime_error.
int open_raw_socket(const std::string& device);

/// Number of the interface of that name; 0, with errno, where there is none. Does not allocate. One
/// system call.
int interface_index(int socket, const std::string& device) noexcept;
/// False, with errno, where it is gone or no CAN interface. Does not allocate. One system call.
bool bind_to_index(int socket, int index) noexcept;
/// Both of them.
bool bind_to(int socket, const std::string& device) noexcept;
/// The same, but throws std::runtime_error that says what to do.
void bind_or_throw(int socket, const std::string& device);

/// Whether the interface is there and up. One system call.
bool is_up(int socket, const std::string& device) noexcept;

/// A frame as the kernel has it; kNotSupported kinds (error frames) give 0, else the size to send.
std::size_t to_kernel(const Frame& frame, canfd_frame& out);
/// Nothing if `size` is that of no CAN frame. Time and interface stay as they are.
bool from_kernel(const canfd_frame& in, std::size_t size, Frame& out);

}  // namespace topoloc::can

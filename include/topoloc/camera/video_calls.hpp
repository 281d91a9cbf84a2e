// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace topoloc::camera {

/// The system calls that a V4L2 camera takes: an interface, so that tests can be the driver.
/// Results below zero are -errno; calls that a signal interrupts are repeated.
class VideoCalls {
 public:
  virtual ~VideoCalls() = default;

  /// For reading and writing, not blocking. A descriptor.
  virtual int open(const std::string& path) = 0;
  virtual void close(int descriptor) = 0;
  /// ioctl(2): `argument` is the struct that belongs to the request.
  virtual int control(int descriptor, unsigned long request, void* argument) = 0;
  /// A buffer of the driver, shared and readable; nullptr if that fails.
  virtual void* map(int descriptor, std::size_t bytes, std::int64_t offset) = 0;
  virtual void unmap(void* memory, std::size_t bytes) = 0;
  /// poll(2) for input: its events, 0 after the timeout.
  virtual int wait(int descriptor, int timeout_ms) = 0;

  /// CLOCK_MONOTONIC.
  virtual std::int64_t now_ns() = 0;
  /// Unix time less that.
  virtual std::int64_t system_ahead_ns() = 0;
  virtual void sleep_ms(int duration_ms) = 0;

  /// Device files of video devices (/dev/video*), in order of number.
  virtual std::vector<std::string> devices() = 0;
};

/// The machine's own.
VideoCalls& system_video_calls();

}  // namespace topoloc::camera

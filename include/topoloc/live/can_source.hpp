// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/can_counters.hpp"
#include "topoloc/can/frame.hpp"

#include <cstdint>
#include <span>

namespace topoloc::live {

/// Where the CAN frames of a tick come from: the bus, or a test.
class CanSource {
 public:
  virtual ~CanSource() = default;

  /// What has come in, in the order of its stamps (by the system clock), up to a limit; the rest
  /// stays for the next call, until which the span is valid. Called by the estimator thread: does
  /// not block, allocate, lock or throw.
  virtual std::span<const can::Frame> receive() noexcept = 0;
  /// The system clock was set, by so much ahead. In the estimator thread, before receive().
  virtual void system_clock_set(std::int64_t by_ns) noexcept = 0;
  [[nodiscard]] virtual can::CanCounters counters() const noexcept = 0;
};

}  // namespace topoloc::live

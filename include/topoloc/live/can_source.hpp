// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/frame.hpp"

#include <cstddef>
#include <span>

namespace topoloc::live {

/// Where the CAN frames of a tick come from: the bus, or a test.
class CanSource {
 public:
  virtual ~CanSource() = default;

  /// Takes what has come in, in the order of its stamps (by the system clock), as much as fits; the
  /// rest stays for the next call. Called by the estimator thread: does not block, allocate, lock
  /// or throw.
  virtual std::size_t receive(std::span<can::Frame> frames) noexcept = 0;
};

}  // namespace topoloc::live

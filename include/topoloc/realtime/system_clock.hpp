// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>

namespace topoloc::realtime {

/// How far the system clock (Unix time) is ahead of CLOCK_MONOTONIC. It changes by steps only, when
/// the system clock is set: both clocks are slewed alike.
struct SystemAhead {
  std::int64_t ahead_ns = 0;
  /// Between which bounds that was read: large where the thread was interrupted meanwhile.
  std::int64_t within_ns = 0;
};

/// The tightest of a few readings, of up to 50 where the thread is interrupted again and again. Any
/// thread; neither fails nor allocates.
[[nodiscard]] SystemAhead read_system_ahead();

}  // namespace topoloc::realtime

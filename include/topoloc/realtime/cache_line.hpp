// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>

namespace topoloc::realtime {

/// What one core must not share with another: two threads that write on one line slow each other.
inline constexpr std::size_t kCacheLineBytes = 64;

}  // namespace topoloc::realtime

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <functional>

namespace topoloc::rendering {

/// Calls `row(i)` for i in [0, count), each once, on `threads` threads (0: one per usable CPU).
/// Rows may run in any order: what they write must not depend on it. The first exception is thrown
/// on once all have ended.
void parallel_rows(int count, int threads, const std::function<void(int)>& row);

}  // namespace topoloc::rendering

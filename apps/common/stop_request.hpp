// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <atomic>
#include <csignal>

namespace topoloc::apps {

/// Set by SIGINT, SIGTERM and SIGHUP (a closed terminal) once stop_on_signals() was called.
inline std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

inline void stop_on_signals() {
  const auto stop = [](int) { stop_requested = true; };
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  if (std::signal(SIGHUP, stop) == SIG_IGN) {  // nohup
    std::signal(SIGHUP, SIG_IGN);
  }
}

}  // namespace topoloc::apps

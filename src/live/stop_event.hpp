// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "live/wake_event.hpp"

#include <array>
#include <atomic>
#include <poll.h>

namespace topoloc::live {

/// Tells threads to end, and wakes those that sleep on it.
class StopEvent {
 public:
  void set() {
    set_.store(true, std::memory_order_release);
    eventfd_write(wake_.fd(), 1);  // never read: it wakes all, for good
  }

  /// Sleeps until it is set, `other_fd` (if given) can be read, or so long (-1: forever). Whether
  /// it is set.
  [[nodiscard]] bool wait(int timeout_ms, int other_fd = -1) const {
    std::array<pollfd, 2> wakers{pollfd{.fd = wake_.fd(), .events = POLLIN, .revents = 0},
                                 pollfd{.fd = other_fd, .events = POLLIN, .revents = 0}};
    poll(wakers.data(), wakers.size(), timeout_ms);
    return set_.load(std::memory_order_acquire);
  }

 private:
  WakeEvent wake_;
  std::atomic<bool> set_{false};
};

}  // namespace topoloc::live

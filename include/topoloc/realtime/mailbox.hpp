// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <utility>

namespace topoloc::realtime {

/// What became of everything put into a mailbox: put = taken + overwritten + discarded, plus one
/// if there is one to be taken.
struct MailboxCounts {
  std::uint64_t put = 0;
  std::uint64_t taken = 0;
  std::uint64_t overwritten = 0;  ///< a newer one came before it was taken
  std::uint64_t discarded = 0;    ///< put after close(), or not taken before it
};

enum class MailboxTake : std::uint8_t {
  kTaken,
  kTimeout,
  kClosed,  ///< and will stay so
};

/// Newest wins, between threads that may wait: not for the estimator's, since it takes a lock.
///
/// Values are swapped in and out, so that buffers (images) go round and are allocated once: what
/// put() gives back and take() takes are buffers used before. Any number of threads may call any
/// function.
template <typename T>
class Mailbox {
 public:
  /// Leaves in `value` what was there before, to be filled anew.
  void put(T& value) {
    {
      const std::scoped_lock lock(mutex_);
      ++counts_.put;
      if (closed_) {
        ++counts_.discarded;
        return;
      }
      counts_.overwritten += full_ ? 1 : 0;
      std::swap(value_, value);
      full_ = true;
    }
    // After the lock: whoever is woken need not wait for it.
    changed_.notify_one();
  }

  /// Waits for a value that was not taken before and swaps it into `value`; unless kTaken, `value`
  /// is as it was. A timeout of zero looks and does not wait.
  [[nodiscard]] MailboxTake take(T& value, std::chrono::nanoseconds timeout) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, timeout, [this] { return full_ || closed_; })) {
      return MailboxTake::kTimeout;
    }
    if (closed_) {
      return MailboxTake::kClosed;
    }
    std::swap(value, value_);
    full_ = false;
    ++counts_.taken;
    return MailboxTake::kTaken;
  }

  /// For a quick end: wakes all who wait, and what was not taken is not handed out any more.
  void close() {
    {
      const std::scoped_lock lock(mutex_);
      counts_.discarded += full_ ? 1 : 0;
      full_ = false;
      closed_ = true;
    }
    changed_.notify_all();
  }

  [[nodiscard]] MailboxCounts counts() const {
    const std::scoped_lock lock(mutex_);
    return counts_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  T value_{};
  bool full_ = false;
  bool closed_ = false;
  MailboxCounts counts_;
};

}  // namespace topoloc::realtime

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/realtime/cache_line.hpp"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <vector>

namespace topoloc::realtime {

/// First in, first out between one writing and one reading thread, neither of which ever waits.
///
/// The slots are made by the constructor and never after; a T that owns memory keeps it in its
/// slot, so large things are written and read in place: fill *write_slot(), then commit_write().
/// One thread may call the writer's functions and one the reader's; size() is for all.
template <typename T>
class SpscRing {
 public:
  /// `capacity` slots, each `T()`. Throws std::invalid_argument if zero.
  explicit SpscRing(std::size_t capacity) : slots_(checked(capacity)) {}

  [[nodiscard]] std::size_t capacity() const { return slots_.size(); }

  /// Things written and not yet read. To the writer the most there can be, to the reader the least;
  /// to others what was so a moment ago.
  [[nodiscard]] std::size_t size() const {
    // Reads first: the other order could find more read than written.
    const std::uint64_t read = read_.load(std::memory_order_acquire);
    const std::uint64_t written = written_.load(std::memory_order_acquire);
    return std::min(static_cast<std::size_t>(written - read), slots_.size());
  }

  /// Writer: the next free slot, with what it held when it was last used; null when full.
  [[nodiscard]] T* write_slot() {
    const std::uint64_t written = written_.load(std::memory_order_relaxed);
    if (written - read_seen_ == slots_.size()) {
      // Acquire: the reader is done with the slot before it is written anew.
      read_seen_ = read_.load(std::memory_order_acquire);
      if (written - read_seen_ == slots_.size()) {
        return nullptr;
      }
    }
    return &slots_[written % slots_.size()];
  }

  /// Writer: hands over the slot that write_slot() gave; nothing else may be committed.
  void commit_write() {
    const std::uint64_t written = written_.load(std::memory_order_relaxed);
    assert(written - read_seen_ < slots_.size());
    written_.store(written + 1, std::memory_order_release);
  }

  /// Writer: copies into the next slot. False when full: nothing was taken.
  [[nodiscard]] bool try_push(const T& value) {
    T* slot = write_slot();
    if (slot == nullptr) {
      return false;
    }
    *slot = value;
    commit_write();
    return true;
  }

  /// Reader: the oldest thing, which stays the reader's until commit_read(); null when empty.
  [[nodiscard]] T* read_slot() {
    const std::uint64_t read = read_.load(std::memory_order_relaxed);
    if (read == written_seen_) {
      // Acquire: the slot's content is there before it is read.
      written_seen_ = written_.load(std::memory_order_acquire);
      if (read == written_seen_) {
        return nullptr;
      }
    }
    return &slots_[read % slots_.size()];
  }

  /// Reader: gives back the slot that read_slot() gave; nothing else may be committed.
  void commit_read() {
    const std::uint64_t read = read_.load(std::memory_order_relaxed);
    assert(read != written_seen_);
    read_.store(read + 1, std::memory_order_release);
  }

  /// Reader: copies the oldest thing out. False when empty: `value` is as it was.
  [[nodiscard]] bool try_pop(T& value) {
    const T* slot = read_slot();
    if (slot == nullptr) {
      return false;
    }
    value = *slot;
    commit_read();
    return true;
  }

 private:
  static std::size_t checked(std::size_t capacity) {
    if (capacity == 0) {
      throw std::invalid_argument("SpscRing: capacity must be at least 1, found 0");
    }
    return capacity;
  }

  // Counters of all time, not positions: full and empty differ without a slot left free, and 64
  // bits do not run over. Each side keeps what it last saw of the other's counter, so that it
  // touches the other's cache line only when that no longer tells enough.
  std::vector<T> slots_;
  alignas(kCacheLineBytes) std::atomic<std::uint64_t> written_{0};
  std::uint64_t read_seen_ = 0;  ///< writer's
  alignas(kCacheLineBytes) std::atomic<std::uint64_t> read_{0};
  std::uint64_t written_seen_ = 0;  ///< reader's
};

}  // namespace topoloc::realtime

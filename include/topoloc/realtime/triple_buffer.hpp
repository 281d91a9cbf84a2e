// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/realtime/cache_line.hpp"

#include <array>
#include <atomic>
#include <cstdint>

namespace topoloc::realtime {

/// The newest value, from one writing to one reading thread, neither of which ever waits or finds
/// the other in its slot.
///
/// Writer and reader own a slot each; the third changes hands by one atomic exchange. Values that
/// were overtaken before they were read are lost: for a stream, take SpscRing.
template <typename T>
class TripleBuffer {
 public:
  /// All three slots start as `initial`; it does not count as new.
  explicit TripleBuffer(const T& initial = T()) : slots_{Slot{initial}, {initial}, {initial}} {}

  /// Writer: the slot to fill. It holds something older, maybe partly read; never what the reader
  /// has now.
  [[nodiscard]] T& write_slot() { return slots_[writers_].value; }

  /// Writer: hands over write_slot(). True: the value before it was never read.
  bool publish() {
    // Release: the content goes with it. Acquire: the reader is done with the slot that comes back.
    const std::uint8_t before =
        shared_.exchange(static_cast<std::uint8_t>(writers_ | kNew), std::memory_order_acq_rel);
    writers_ = before & kIndex;
    return (before & kNew) != 0;
  }

  /// Writer: copies and hands over. True: the value before it was never read.
  bool write(const T& value) {
    write_slot() = value;
    return publish();
  }

  /// Reader: takes the newest value, if there is one it has not had. False: read() is as before.
  [[nodiscard]] bool update() {
    if ((shared_.load(std::memory_order_relaxed) & kNew) == 0) {
      return false;
    }
    readers_ = shared_.exchange(readers_, std::memory_order_acq_rel) & kIndex;
    return true;
  }

  /// Reader: the value as of the last update(); stays untouched until the next.
  [[nodiscard]] const T& read() const { return slots_[readers_].value; }

 private:
  static constexpr std::uint8_t kIndex = 3;
  static constexpr std::uint8_t kNew = 4;
  /// On cache lines of its own: filling one slot does not slow down reading its neighbour.
  struct alignas(kCacheLineBytes) Slot {
    T value;
  };

  std::array<Slot, 3> slots_;
  alignas(kCacheLineBytes) std::uint8_t writers_ = 0;
  alignas(kCacheLineBytes) std::uint8_t readers_ = 1;
  alignas(kCacheLineBytes) std::atomic<std::uint8_t> shared_{
      2};  ///< index of the free slot, and whether new
};

}  // namespace topoloc::realtime

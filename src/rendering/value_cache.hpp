// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace topoloc::rendering {

/// Remembers values by a 64-bit key; threads read and add without locks. Meant for values that are
/// functions of their key: whether one was remembered, and by which thread, changes nothing.
class ValueCache {
 public:
  /// At 16 bytes a slot. Default: 256 MB.
  explicit ValueCache(std::size_t most_slots = std::size_t{1} << 24U);

  [[nodiscard]] std::optional<float> find(std::uint64_t key) const;
  /// Does nothing where it is crowded.
  void add(std::uint64_t key, float value);
  /// Makes room for as many again once it is half full; forgets everything once that would take
  /// too much memory. Not while other threads use it.
  void make_room();

 private:
  void clear();

  struct Slot {
    std::atomic<std::uint64_t> key = 0;  ///< 0: free
    std::atomic<float> value = 0.0F;
  };
  std::size_t most_slots_;
  std::vector<Slot> slots_;
  std::atomic<std::size_t> used_ = 0;
};

}  // namespace topoloc::rendering

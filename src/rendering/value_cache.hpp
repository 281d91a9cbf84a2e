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
  struct Value {
    float a = 0.0F;
    float b = 0.0F;
  };

  ValueCache();

  [[nodiscard]] std::optional<Value> find(std::uint64_t key) const;
  /// Does nothing where it is crowded.
  void add(std::uint64_t key, Value value);
  /// Makes room for as many again once it is half full. Not while other threads use it.
  void grow_if_full();

 private:
  struct Slot {
    std::atomic<std::uint64_t> key = 0;  ///< 0: free
    std::atomic<std::uint64_t> value = 0;
  };
  std::vector<Slot> slots_;
  std::atomic<std::size_t> used_ = 0;
};

}  // namespace topoloc::rendering

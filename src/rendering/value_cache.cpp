// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/value_cache.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace topoloc::rendering {
namespace {

constexpr std::size_t kFirstSlots = std::size_t{1} << 18U;
constexpr std::size_t kProbes = 16;
// Of a slot that was taken but not yet filled.
constexpr float kEmpty = std::numeric_limits<float>::quiet_NaN();

}  // namespace

ValueCache::ValueCache(std::size_t most_slots) : most_slots_(most_slots), slots_(kFirstSlots) {
  clear();
}

void ValueCache::clear() {
  for (Slot& slot : slots_) {
    slot.key.store(0, std::memory_order_relaxed);
    slot.value.store(kEmpty, std::memory_order_relaxed);
  }
  used_ = 0;
}

std::optional<float> ValueCache::find(std::uint64_t key) const {
  for (std::size_t i = 0; i < kProbes; ++i) {
    const Slot& slot = slots_[(key + i) & (slots_.size() - 1)];
    const std::uint64_t held = slot.key.load(std::memory_order_acquire);
    if (held == 0) {
      return std::nullopt;
    }
    if (held == key) {
      const float value = slot.value.load(std::memory_order_acquire);
      return std::isnan(value) ? std::nullopt : std::optional(value);
    }
  }
  return std::nullopt;
}

void ValueCache::add(std::uint64_t key, float value) {
  for (std::size_t i = 0; i < kProbes; ++i) {
    Slot& slot = slots_[(key + i) & (slots_.size() - 1)];
    std::uint64_t held = slot.key.load(std::memory_order_acquire);
    if (held == 0 && slot.key.compare_exchange_strong(held, key, std::memory_order_acq_rel)) {
      used_.fetch_add(1, std::memory_order_relaxed);
      held = key;
    }
    if (held == key) {
      slot.value.store(value, std::memory_order_release);
      return;
    }
  }
}

void ValueCache::make_room() {
  if (2 * used_ < slots_.size()) {
    return;
  }
  if (slots_.size() >= most_slots_) {
    clear();
    return;
  }
  std::vector<Slot> old(2 * slots_.size());
  std::swap(old, slots_);
  clear();
  for (const Slot& slot : old) {
    const float value = slot.value.load(std::memory_order_relaxed);
    if (!std::isnan(value)) {
      add(slot.key, value);
    }
  }
}

}  // namespace topoloc::rendering

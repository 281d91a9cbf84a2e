// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/value_cache.hpp"

#include <bit>
#include <utility>

namespace topoloc::rendering {
namespace {

constexpr std::size_t kFirstSlots = std::size_t{1} << 18U;
constexpr std::size_t kProbes = 16;
// Of a slot that was taken but not yet filled: no pair of numbers looks like it.
constexpr std::uint64_t kEmpty = ~std::uint64_t{0};

std::uint64_t bits(ValueCache::Value value) {
  return std::uint64_t{std::bit_cast<std::uint32_t>(value.a)} << 32U |
         std::bit_cast<std::uint32_t>(value.b);
}

}  // namespace

ValueCache::ValueCache() : slots_(kFirstSlots) {
  for (Slot& slot : slots_) {
    slot.value.store(kEmpty, std::memory_order_relaxed);
  }
}

std::optional<ValueCache::Value> ValueCache::find(std::uint64_t key) const {
  for (std::size_t i = 0; i < kProbes; ++i) {
    const Slot& slot = slots_[(key + i) & (slots_.size() - 1)];
    const std::uint64_t held = slot.key.load(std::memory_order_acquire);
    if (held == 0) {
      return std::nullopt;
    }
    if (held == key) {
      const std::uint64_t value = slot.value.load(std::memory_order_acquire);
      if (value == kEmpty) {
        return std::nullopt;
      }
      return Value{std::bit_cast<float>(static_cast<std::uint32_t>(value >> 32U)),
                   std::bit_cast<float>(static_cast<std::uint32_t>(value))};
    }
  }
  return std::nullopt;
}

void ValueCache::add(std::uint64_t key, Value value) {
  for (std::size_t i = 0; i < kProbes; ++i) {
    Slot& slot = slots_[(key + i) & (slots_.size() - 1)];
    std::uint64_t held = slot.key.load(std::memory_order_acquire);
    if (held == 0 && slot.key.compare_exchange_strong(held, key, std::memory_order_acq_rel)) {
      used_.fetch_add(1, std::memory_order_relaxed);
      held = key;
    }
    if (held == key) {
      slot.value.store(bits(value), std::memory_order_release);
      return;
    }
  }
}

void ValueCache::grow_if_full() {
  if (2 * used_ < slots_.size()) {
    return;
  }
  std::vector<Slot> old(2 * slots_.size());
  for (Slot& slot : old) {
    slot.value.store(kEmpty, std::memory_order_relaxed);
  }
  std::swap(old, slots_);
  used_ = 0;
  for (const Slot& slot : old) {
    const std::uint64_t value = slot.value.load(std::memory_order_relaxed);
    if (value != kEmpty) {
      add(slot.key, {std::bit_cast<float>(static_cast<std::uint32_t>(value >> 32U)),
                     std::bit_cast<float>(static_cast<std::uint32_t>(value))});
    }
  }
}

}  // namespace topoloc::rendering

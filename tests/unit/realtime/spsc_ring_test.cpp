// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/spsc_ring.hpp"

#include <array>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::realtime {
namespace {

TEST(SpscRing, GivesWhatWasPutInThatOrder) {
  SpscRing<int> ring(3);
  int value = 0;
  // Round and round: every slot is first at some time.
  for (int i = 0; i < 20; i += 2) {
    EXPECT_TRUE(ring.try_push(i));
    EXPECT_TRUE(ring.try_push(i + 1));
    EXPECT_EQ(ring.size(), 2U);
    EXPECT_TRUE(ring.try_pop(value));
    EXPECT_EQ(value, i);
    EXPECT_TRUE(ring.try_pop(value));
    EXPECT_EQ(value, i + 1);
    EXPECT_EQ(ring.size(), 0U);
  }
}

TEST(SpscRing, UsesEverySlotAndRefusesMore) {
  SpscRing<int> ring(3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(ring.try_push(i));
  }
  EXPECT_EQ(ring.size(), ring.capacity());
  EXPECT_FALSE(ring.try_push(3));
  EXPECT_EQ(ring.write_slot(), nullptr);
  int value = -1;
  EXPECT_TRUE(ring.try_pop(value));
  EXPECT_EQ(value, 0);
  EXPECT_TRUE(ring.try_push(3));
}

TEST(SpscRing, EmptyGivesNothingAndLeavesTheValue) {
  SpscRing<int> ring(1);
  int value = 7;
  EXPECT_FALSE(ring.try_pop(value));
  EXPECT_EQ(value, 7);
  EXPECT_EQ(ring.read_slot(), nullptr);
}

TEST(SpscRing, ASlotNotCommittedIsNotSeen) {
  SpscRing<int> ring(2);
  *ring.write_slot() = 1;
  EXPECT_EQ(ring.read_slot(), nullptr);
  ring.commit_write();
  ASSERT_NE(ring.read_slot(), nullptr);
  EXPECT_EQ(*ring.read_slot(), 1);
  EXPECT_EQ(ring.size(), 1U) << "read, but not given back";
  ring.commit_read();
  EXPECT_EQ(ring.size(), 0U);
}

TEST(SpscRing, SlotsKeepTheirMemory) {
  SpscRing<std::vector<int>> ring(2);
  std::array<const int*, 2> first{};
  for (int round = 0; round < 6; ++round) {
    std::vector<int>* slot = ring.write_slot();
    ASSERT_NE(slot, nullptr);
    slot->assign(1000, round);
    const auto which = static_cast<std::size_t>(round % 2);
    first[which] = round < 2 ? slot->data() : first[which];
    EXPECT_EQ(slot->data(), first[which]);
    ring.commit_write();
    ASSERT_NE(ring.read_slot(), nullptr);
    ring.commit_read();
  }
}

TEST(SpscRing, HoldsWhatCannotBeCopied) {
  SpscRing<std::unique_ptr<int>> ring(1);
  *ring.write_slot() = std::make_unique<int>(5);
  ring.commit_write();
  EXPECT_EQ(**ring.read_slot(), 5);
}

TEST(SpscRing, RefusesCapacityOfZero) { EXPECT_THROW(SpscRing<int>(0), std::invalid_argument); }

// Under ThreadSanitizer this also proves that slots change hands without a race.
TEST(SpscRing, NothingLostOrTornBetweenTwoThreads) {
  constexpr std::uint64_t kCount = 200'000;
  using Block = std::array<std::uint64_t, 8>;
  SpscRing<Block> ring(7);
  std::thread writer([&ring] {
    for (std::uint64_t i = 0; i < kCount;) {
      Block* slot = ring.write_slot();
      if (slot == nullptr) {
        std::this_thread::yield();
        continue;
      }
      slot->fill(i++);
      ring.commit_write();
    }
  });
  std::uint64_t wrong = 0;
  std::uint64_t oversized = 0;
  for (std::uint64_t i = 0; i < kCount;) {
    const Block* slot = ring.read_slot();
    if (slot == nullptr) {
      std::this_thread::yield();
      continue;
    }
    for (const std::uint64_t value : *slot) {
      wrong += value != i ? 1 : 0;
    }
    oversized += ring.size() == 0 || ring.size() > ring.capacity() ? 1 : 0;
    ring.commit_read();
    ++i;
  }
  writer.join();
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(oversized, 0U);
  EXPECT_EQ(ring.size(), 0U);
}

}  // namespace
}  // namespace topoloc::realtime

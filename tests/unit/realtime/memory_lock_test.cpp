// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/memory_lock.hpp"

#include "support/without_privileges.hpp"

#include <cstdlib>
#include <sys/mman.h>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::realtime {
namespace {

using ::testing::HasSubstr;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

constexpr std::size_t kBlock = std::size_t{4} << 20;

TEST(MemoryLock, LocksWhatIsMappedAndNotWhatComesLater) {
  if (kSanitized) {
    GTEST_SKIP() << "sanitizers map too much to lock";
  }
  const MemoryLock lock = lock_memory();
  if (!lock.locked) {
    EXPECT_EQ(lock.locked_bytes, 0U);
    GTEST_SKIP() << lock.warning;
  }
  EXPECT_TRUE(lock.warning.empty());
  EXPECT_GT(lock.locked_bytes, 0U);
  void* later = mmap(nullptr, kBlock, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(later, MAP_FAILED);
  unsigned char in_memory[kBlock / 4096] = {};
  EXPECT_EQ(mincore(later, kBlock, in_memory), 0);
  for (const unsigned char page : in_memory) {
    EXPECT_EQ(page & 1U, 0U);
  }
  // Locking again takes it in: that is what must not happen to the map.
  EXPECT_GE(lock_memory().locked_bytes, lock.locked_bytes + kBlock);
  munmap(later, kBlock);
  unlock_memory();
}

TEST(MemoryLock, WithoutPrivilegeSaysWhatToDo) {
  if (kSanitized) {
    GTEST_SKIP() << "sanitizers do not lock at all";
  }
  test::without_privileges([] {
    const MemoryLock lock = lock_memory();
    EXPECT_FALSE(lock.locked);
    EXPECT_EQ(lock.locked_bytes, 0U);
    EXPECT_THAT(lock.warning, HasSubstr("memory is not locked"));
    EXPECT_THAT(lock.warning, HasSubstr("ulimit -l, is 0 MB"));
    EXPECT_THAT(lock.warning, HasSubstr("LimitMEMLOCK=infinity"));
  });
}

TEST(PageFaults, AreThoseOfTheCallingThread) {
  if (kSanitized) {
    GTEST_SKIP() << "sanitizers have page faults of their own";
  }
  void* block = mmap(nullptr, kBlock, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(block, MAP_FAILED);
  madvise(block, kBlock, MADV_NOHUGEPAGE);
  const auto touch = [block] {
    for (std::size_t at = 0; at < kBlock; at += 4096) {
      static_cast<volatile char*>(block)[at] = 1;
    }
  };
  const PageFaults before = thread_page_faults();
  touch();
  const PageFaults first = thread_page_faults();
  EXPECT_GE(first.minor - before.minor, kBlock / 4096);
  std::uint64_t of_other = 0;
  madvise(block, kBlock, MADV_DONTNEED);
  std::thread([&] {
    const PageFaults at_start = thread_page_faults();
    touch();
    of_other = thread_page_faults().minor - at_start.minor;
  }).join();
  EXPECT_GE(of_other, kBlock / 4096);
  EXPECT_LT(thread_page_faults().minor - first.minor, kBlock / 4096 / 2);
  munmap(block, kBlock);
}

TEST(PrefaultStack, TouchesNoMoreThanThereIs) {
  std::size_t touched = 0;
  std::thread([&touched] { touched = prefault_stack(std::size_t{1} << 40); }).join();
  EXPECT_GT(touched, 0U);
  EXPECT_LT(touched, std::size_t{1} << 30);
  EXPECT_EQ(prefault_stack(100'000), 100'000U);
  EXPECT_EQ(prefault_stack(0), 0U);
}

// Images of a few megabytes come and go: their pages must stay.
TEST(KeepHeap, FreedBlocksAreUsedAgainWithoutPageFaults) {
  if (kSanitized) {
    GTEST_SKIP() << "sanitizers bring their own heap";
  }
  keep_heap(std::size_t{64} << 20);
  const auto use = [] {
    auto* block = static_cast<volatile char*>(std::malloc(3 * kBlock));
    for (std::size_t at = 0; at < 3 * kBlock; at += 4096) {
      block[at] = 1;
    }
    std::free(const_cast<char*>(block));
  };
  const std::uint64_t before = thread_page_faults().minor;
  for (int i = 0; i < 10; ++i) {
    use();
  }
  EXPECT_LT(thread_page_faults().minor - before, 100U) << "of 30720 pages used";
}

}  // namespace
}  // namespace topoloc::realtime

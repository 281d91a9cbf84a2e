// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/triple_buffer.hpp"

#include <atomic>
#include <thread>

#include <gtest/gtest.h>

namespace topoloc::realtime {
namespace {

TEST(TripleBuffer, StartsWithTheInitialValueAndNothingNew) {
  TripleBuffer<int> buffer(5);
  EXPECT_FALSE(buffer.update());
  EXPECT_EQ(buffer.read(), 5);
}

TEST(TripleBuffer, TellsOnceThatThereIsSomethingNew) {
  TripleBuffer<int> buffer;
  buffer.write(1);
  EXPECT_EQ(buffer.read(), 0) << "not before update()";
  EXPECT_TRUE(buffer.update());
  EXPECT_EQ(buffer.read(), 1);
  EXPECT_FALSE(buffer.update());
  EXPECT_EQ(buffer.read(), 1);
}

TEST(TripleBuffer, NewestWins) {
  TripleBuffer<int> buffer;
  EXPECT_FALSE(buffer.write(1));
  EXPECT_TRUE(buffer.write(2)) << "1 was never read";
  EXPECT_TRUE(buffer.write(3));
  EXPECT_TRUE(buffer.update());
  EXPECT_EQ(buffer.read(), 3);
  EXPECT_FALSE(buffer.write(4));
}

TEST(TripleBuffer, WritingLeavesWhatIsBeingReadAlone) {
  TripleBuffer<int> buffer;
  buffer.write(1);
  EXPECT_TRUE(buffer.update());
  const int& held = buffer.read();
  for (int i = 2; i < 10; ++i) {
    buffer.write_slot() = i;
    EXPECT_EQ(held, 1);
    buffer.publish();
    EXPECT_EQ(held, 1);
  }
}

// Under ThreadSanitizer this also proves that slots change hands without a race.
TEST(TripleBuffer, ReaderSeesWholeValuesThatOnlyGetNewer) {
  constexpr std::uint64_t kCount = 200'000;
  using Block = std::array<std::uint64_t, 16>;
  TripleBuffer<Block> buffer(Block{});
  std::atomic<bool> done{false};
  std::thread writer([&] {
    for (std::uint64_t i = 1; i <= kCount; ++i) {
      buffer.write_slot().fill(i);
      buffer.publish();
    }
    done.store(true);
  });
  std::uint64_t torn = 0;
  std::uint64_t older = 0;
  std::uint64_t last = 0;
  for (bool ended = false; !ended;) {
    ended = done.load();
    if (!buffer.update()) {
      std::this_thread::yield();
      continue;
    }
    const Block& block = buffer.read();
    for (const std::uint64_t value : block) {
      torn += value != block[0] ? 1 : 0;
    }
    older += block[0] <= last ? 1 : 0;
    last = block[0];
  }
  writer.join();
  EXPECT_EQ(torn, 0U);
  EXPECT_EQ(older, 0U);
  EXPECT_EQ(last, kCount) << "the newest is never lost";
}

}  // namespace
}  // namespace topoloc::realtime

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/mailbox.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::realtime {
namespace {

using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;

TEST(Mailbox, HandsOverAValueOnce) {
  Mailbox<int> mailbox;
  int value = 4;
  mailbox.put(value);
  value = 0;
  EXPECT_EQ(mailbox.take(value, 0s), MailboxTake::kTaken);
  EXPECT_EQ(value, 4);
  EXPECT_EQ(mailbox.take(value, 0s), MailboxTake::kTimeout);
  EXPECT_EQ(value, 4);
}

TEST(Mailbox, NewestWinsAndTheOthersAreCounted) {
  Mailbox<int> mailbox;
  for (int i = 1; i <= 4; ++i) {
    int value = i;
    mailbox.put(value);
  }
  int value = 0;
  EXPECT_EQ(mailbox.take(value, 0s), MailboxTake::kTaken);
  EXPECT_EQ(value, 4);
  const MailboxCounts counts = mailbox.counts();
  EXPECT_EQ(counts.put, 4U);
  EXPECT_EQ(counts.taken, 1U);
  EXPECT_EQ(counts.overwritten, 3U);
  EXPECT_EQ(counts.discarded, 0U);
}

TEST(Mailbox, WaitsNoLongerThanTheTimeout) {
  Mailbox<int> mailbox;
  int value = 0;
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(mailbox.take(value, 20ms), MailboxTake::kTimeout);
  EXPECT_GE(std::chrono::steady_clock::now() - start, 20ms);
}

TEST(Mailbox, BuffersGoRound) {
  Mailbox<std::vector<int>> mailbox;
  std::vector<int> in(100);
  std::vector<int> out(100);
  // The mailbox's own buffer is empty at first; after three exchanges all have been round.
  const auto exchange = [&] {
    in.resize(100);
    mailbox.put(in);
    EXPECT_EQ(mailbox.take(out, 0s), MailboxTake::kTaken);
  };
  exchange();
  exchange();
  exchange();
  std::vector<const int*> known{in.data(), out.data()};
  exchange();
  known.push_back(in.data());
  for (int i = 0; i < 10; ++i) {
    exchange();
    EXPECT_NE(std::find(known.begin(), known.end(), in.data()), known.end());
    EXPECT_NE(std::find(known.begin(), known.end(), out.data()), known.end());
  }
}

TEST(Mailbox, CloseEndsTheWait) {
  Mailbox<int> mailbox;
  std::thread closer([&mailbox] { mailbox.close(); });
  int value = 0;
  EXPECT_EQ(mailbox.take(value, 60s), MailboxTake::kClosed);
  closer.join();
}

TEST(Mailbox, ClosedHandsOutNothingAndCountsWhatIsDiscarded) {
  Mailbox<int> mailbox;
  int value = 1;
  mailbox.put(value);
  mailbox.close();
  mailbox.put(value);
  EXPECT_EQ(mailbox.take(value, 60s), MailboxTake::kClosed);
  EXPECT_EQ(mailbox.counts().put, 2U);
  EXPECT_EQ(mailbox.counts().discarded, 2U);
}

TEST(Mailbox, EveryValueIsAccountedForBetweenThreads) {
  constexpr int kCount = 20'000;
  Mailbox<std::vector<int>> mailbox;
  std::thread writer([&mailbox] {
    std::vector<int> value;
    for (int i = 1; i <= kCount; ++i) {
      value.assign(16, i);
      mailbox.put(value);
    }
  });
  int last = 0;
  std::uint64_t taken = 0;
  std::vector<int> value;
  while (last != kCount) {
    ASSERT_EQ(mailbox.take(value, 60s), MailboxTake::kTaken);
    ASSERT_GT(value.front(), last);
    ASSERT_EQ(value.front(), value.back());
    last = value.front();
    ++taken;
  }
  writer.join();
  EXPECT_EQ(mailbox.counts().taken, taken);
  EXPECT_EQ(taken + mailbox.counts().overwritten, static_cast<std::uint64_t>(kCount));
}

}  // namespace
}  // namespace topoloc::realtime

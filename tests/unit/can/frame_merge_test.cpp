// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "can/frame_merge.hpp"

#include "support/allocation_trap.hpp"

#include <array>
#include <initializer_list>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::can {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::int64_t kNoHorizon_ns = std::numeric_limits<std::int64_t>::max();

class FrameMergeTest : public ::testing::Test {
 protected:
  explicit FrameMergeTest(std::size_t queues = 2) : queues_(queues, FrameQueue(4)) {}

  void fill(std::size_t queue, std::initializer_list<std::int64_t> times_ns,
            bool cut_short = false) {
    const auto room = queues_[queue].make_room();
    std::size_t count = 0;
    for (const std::int64_t time_ns : times_ns) {
      room[count++].time_ns = time_ns;
    }
    queues_[queue].add(count);
    queues_[queue].cut_short = cut_short;
  }
  std::vector<std::int64_t> merged(std::int64_t horizon_ns = kNoHorizon_ns, std::size_t most = 16) {
    std::vector<Frame> out(most);
    out.resize(merge(queues_, horizon_ns, out));
    std::vector<std::int64_t> times_ns;
    for (const Frame& frame : out) {
      times_ns.push_back(frame.time_ns);
    }
    return times_ns;
  }

  std::vector<FrameQueue> queues_;
};

TEST_F(FrameMergeTest, HandsOutInTheOrderOfStamps) {
  fill(0, {10, 40});
  fill(1, {20, 30, 50});
  EXPECT_THAT(merged(), ElementsAre(10, 20, 30, 40, 50));
  EXPECT_EQ(queues_[0].handed_out(), 2U);
  EXPECT_EQ(queues_[1].handed_out(), 3U);
}

TEST_F(FrameMergeTest, KeepsWhatIsBeyondTheMostForLater) {
  fill(0, {10, 40});
  fill(1, {20, 30});
  EXPECT_THAT(merged(kNoHorizon_ns, 3), ElementsAre(10, 20, 30));
  fill(0, {60});
  fill(1, {50});
  EXPECT_THAT(merged(), ElementsAre(40, 50, 60));
}

TEST_F(FrameMergeTest, HoldsNewFramesBeyondTheHorizonForOneCall) {
  fill(0, {10});
  fill(1, {20, 35});  // read later: 30 may have come on the first interface meanwhile
  EXPECT_THAT(merged(25), ElementsAre(10, 20));
  fill(0, {30, 60});
  fill(1, {});
  EXPECT_THAT(merged(50), ElementsAre(30, 35));
}

TEST_F(FrameMergeTest, DoesNotKeepFramesForEverWhenTheClockIsSetBack) {
  fill(0, {1000});
  fill(1, {});
  EXPECT_THAT(merged(25), IsEmpty());
  fill(0, {30});
  fill(1, {});
  EXPECT_THAT(merged(40), ElementsAre(1000, 30));
}

TEST_F(FrameMergeTest, WaitsForTheRestOfAnInterfaceThatWasCutShort) {
  fill(0, {10, 20, 30, 40}, true);
  fill(1, {15, 55});
  EXPECT_THAT(merged(), ElementsAre(10, 15, 20, 30, 40));
  fill(0, {50});
  fill(1, {});
  EXPECT_THAT(merged(), ElementsAre(50, 55));
}

TEST_F(FrameMergeTest, AllocatesNothing) {
  fill(0, {10, 40});
  fill(1, {20, 30});
  std::array<Frame, 3> out;
  const testing::AllocationTrap trap;
  EXPECT_EQ(merge(queues_, kNoHorizon_ns, out), 3U);
  (void)queues_[0].make_room();
  EXPECT_EQ(trap.count(), 0U);
}

class SingleQueueTest : public FrameMergeTest {
 protected:
  SingleQueueTest() : FrameMergeTest(1) {}
};

TEST_F(SingleQueueTest, NeedsNoHorizon) {
  fill(0, {10, 40}, true);
  EXPECT_THAT(merged(25), ElementsAre(10, 40));
}

}  // namespace
}  // namespace topoloc::can

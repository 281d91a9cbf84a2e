// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/latency_governor.hpp"

#include <gtest/gtest.h>

namespace topoloc::live {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kBudget_ns = 100 * kMs;

void note(LatencyGovernor& governor, int frames, std::int64_t latency_ns) {
  for (int i = 0; i < frames; ++i) {
    governor.note(latency_ns);
  }
}

TEST(LatencyGovernor, StaysWithFullEffortInTheBudget) {
  LatencyGovernor governor(kBudget_ns, 3);
  note(governor, 1000, 99 * kMs);
  EXPECT_EQ(governor.level(), 0);
  EXPECT_EQ(governor.missed(), 0U);
}

TEST(LatencyGovernor, AllowsOneMissInAHundred) {
  LatencyGovernor governor(kBudget_ns, 3);
  for (int i = 0; i < 20; ++i) {
    note(governor, 1, 101 * kMs);
    note(governor, 99, 50 * kMs);
    note(governor, 1, 50 * kMs);
  }
  EXPECT_EQ(governor.level(), 0);
  EXPECT_EQ(governor.missed(), 20U);
}

TEST(LatencyGovernor, DoesLessAfterMoreThanOneMissInAHundred) {
  LatencyGovernor governor(kBudget_ns, 3);
  note(governor, 1, 101 * kMs);
  note(governor, 50, 50 * kMs);
  EXPECT_EQ(governor.level(), 0);
  note(governor, 1, 101 * kMs);
  EXPECT_EQ(governor.level(), 1);
  EXPECT_EQ(governor.slowdowns(), 1U);
}

TEST(LatencyGovernor, KeepsTheLeastEffortWhenThatIsTooSlowToo) {
  LatencyGovernor governor(kBudget_ns, 3);
  note(governor, 1000, 300 * kMs);
  EXPECT_EQ(governor.level(), 2);
  EXPECT_EQ(governor.slowdowns(), 2U);
}

TEST(LatencyGovernor, TriesMoreEffortOnceThereIsTimeToSpare) {
  LatencyGovernor governor(kBudget_ns, 3);
  note(governor, 3, 300 * kMs);
  ASSERT_EQ(governor.level(), 1);
  note(governor, 10'000, 90 * kMs);  // in the budget, and nothing to spare
  EXPECT_EQ(governor.level(), 1);
  note(governor, 200, 40 * kMs);
  EXPECT_EQ(governor.level(), 0);
}

TEST(LatencyGovernor, TriesEverMoreRarelyWhatProvesTooSlow) {
  LatencyGovernor governor(kBudget_ns, 2);
  int tries = 0;
  for (int i = 0; i < 20'000; ++i) {
    const int before = governor.level();
    governor.note(before == 0 ? 150 * kMs : 20 * kMs);
    tries += governor.level() < before ? 1 : 0;
  }
  EXPECT_GE(tries, 3);
  EXPECT_LE(tries, 8);
}

}  // namespace
}  // namespace topoloc::live

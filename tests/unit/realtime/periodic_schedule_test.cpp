// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/periodic_schedule.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace topoloc::realtime {
namespace {

TEST(PeriodicSchedule, DeadlinesDoNotDriftWithLateWakeUps) {
  PeriodicSchedule schedule(1000, 100);
  for (std::int64_t k = 0; k < 50; ++k) {
    EXPECT_EQ(schedule.deadline_ns(), 1000 + 100 * k);
    const auto entered = schedule.enter(schedule.deadline_ns() + k);
    EXPECT_EQ(entered.index, k);
    EXPECT_EQ(entered.deadline_ns, 1000 + 100 * k);
    EXPECT_EQ(entered.missed, 0);
  }
}

TEST(PeriodicSchedule, SkipsAndCountsPeriodsThatWentBy) {
  PeriodicSchedule schedule(1000, 100);
  schedule.enter(1000);
  const auto entered = schedule.enter(1350);
  EXPECT_EQ(entered.index, 3);
  EXPECT_EQ(entered.deadline_ns, 1300);
  EXPECT_EQ(entered.missed, 2);
  EXPECT_EQ(schedule.deadline_ns(), 1400);
}

TEST(PeriodicSchedule, APeriodBelongsToItsStartAndNotToItsEnd) {
  PeriodicSchedule schedule(1000, 100);
  EXPECT_EQ(schedule.enter(1099).missed, 0);
  EXPECT_EQ(schedule.enter(1299).missed, 1) << "the first late by one";
  PeriodicSchedule exact(1000, 100);
  EXPECT_EQ(exact.enter(1100).missed, 1);
}

TEST(PeriodicSchedule, AnEarlyWakeUpEntersTheNextPeriodAllTheSame) {
  PeriodicSchedule schedule(1000, 100);
  EXPECT_EQ(schedule.enter(990).index, 0);
  EXPECT_EQ(schedule.enter(1050).index, 1);
  EXPECT_EQ(schedule.deadline_ns(), 1200);
}

TEST(PeriodicSchedule, EnteredAndMissedAreAllPeriodsBegun) {
  PeriodicSchedule schedule(12'345, 777);
  std::int64_t now = 12'345;
  std::int64_t entered = 0;
  std::int64_t missed = 0;
  for (std::int64_t k = 0; k < 1000; ++k) {
    now = std::max(now + (k * k * 31) % 3000, schedule.deadline_ns());
    missed += schedule.enter(now).missed;
    ++entered;
    ASSERT_EQ(entered + missed, (now - 12'345) / 777 + 1);
  }
  EXPECT_GT(missed, 100);
}

}  // namespace
}  // namespace topoloc::realtime

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/realtime/cyclic_loop.hpp"

#include "topoloc/realtime/triple_buffer.hpp"

#include <atomic>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::realtime {
namespace {

constexpr std::int64_t kPeriod = 1000;

/// Time passes only as told: work takes what it adds, sleep ends late by what is planned.
struct PlannedTime {
  std::int64_t now = 500;
  std::vector<std::int64_t> sleeps_until;
  std::int64_t next_lateness = 0;
};

struct PlannedClock {
  PlannedTime* time;
  [[nodiscard]] std::int64_t now_ns() const { return time->now; }
  void sleep_until(std::int64_t until) const {
    time->sleeps_until.push_back(until);
    time->now = until + time->next_lateness;
    time->next_lateness = 0;
  }
};

/// Runs cycles, each by its planned work, and stops in the last.
struct PlannedLoop {
  PlannedTime time;
  CyclicLoop<PlannedClock> loop{kPeriod, PlannedClock{&time}};
  std::vector<Cycle> cycles;

  void run(const std::vector<std::int64_t>& work_ns) {
    std::atomic<bool> stop{false};
    loop.run(stop, [&](const Cycle& cycle) {
      time.now += work_ns[cycles.size()];
      cycles.push_back(cycle);
      stop.store(cycles.size() == work_ns.size());
    });
  }
  void expect_every_period_accounted_for() const {
    const CycleStats& s = loop.stats();
    EXPECT_EQ(static_cast<std::int64_t>(s.cycles + s.missed),
              (s.last_woken_ns - s.first_deadline_ns) / s.period_ns + 1);
  }
};

TEST(CyclicLoop, SleepsUntilAbsoluteDeadlinesOnePeriodApart) {
  PlannedLoop planned;
  planned.run({100, 200, 300});
  EXPECT_EQ(planned.time.sleeps_until, (std::vector<std::int64_t>{1500, 2500, 3500, 4500}));
  EXPECT_EQ(planned.loop.stats().cycles, 3U);
  EXPECT_EQ(planned.loop.stats().missed, 0U);
  EXPECT_EQ(planned.loop.stats().overruns, 0U);
  planned.expect_every_period_accounted_for();
}

TEST(CyclicLoop, MeasuresWakeUpAndWorkApart) {
  PlannedLoop planned;
  planned.time.next_lateness = 30;
  planned.run({5});
  const CycleStats& stats = planned.loop.stats();
  EXPECT_EQ(stats.wakeup_latency.count(), 1U);
  EXPECT_EQ(stats.wakeup_latency.max_ns(), 30);
  EXPECT_EQ(stats.execution_time.count(), 1U);
  EXPECT_EQ(stats.execution_time.max_ns(), 5);
  EXPECT_EQ(planned.cycles[0].deadline_ns, 1500);
  EXPECT_EQ(planned.cycles[0].woken_ns, 1530);
}

TEST(CyclicLoop, LongWorkSkipsPeriodsAndKeepsThePhase) {
  PlannedLoop planned;
  planned.run({3200, 10, 10});
  // Work from 1500 to 4700: the periods of 2500 and 3500 went by, that of 4500 is begun late.
  EXPECT_EQ(planned.cycles[1].index, 3);
  EXPECT_EQ(planned.cycles[1].missed, 2);
  EXPECT_EQ(planned.cycles[1].deadline_ns, 4500);
  EXPECT_EQ(planned.cycles[1].woken_ns, 4700);
  EXPECT_EQ(planned.cycles[2].deadline_ns, 5500);
  EXPECT_EQ(planned.cycles[2].missed, 0);
  const CycleStats& stats = planned.loop.stats();
  EXPECT_EQ(stats.missed, 2U);
  EXPECT_EQ(stats.overruns, 1U);
  EXPECT_EQ(stats.wakeup_latency.count(), 2U) << "no sleep, no wake-up";
  EXPECT_EQ(stats.wakeup_latency.max_ns(), 0) << "the work's delay is not the system's";
  EXPECT_EQ(stats.execution_time.max_ns(), 3200);
  planned.expect_every_period_accounted_for();
}

TEST(CyclicLoop, LateWakeUpSkipsPeriodsAndIsMeasuredWhole) {
  PlannedLoop planned;
  planned.time.next_lateness = 2300;
  planned.run({10, 10});
  EXPECT_EQ(planned.cycles[0].index, 2);
  EXPECT_EQ(planned.cycles[0].missed, 2);
  EXPECT_EQ(planned.loop.stats().missed, 2U);
  EXPECT_EQ(planned.loop.stats().overruns, 0U);
  EXPECT_EQ(planned.loop.stats().wakeup_latency.max_ns(), 2300);
  planned.expect_every_period_accounted_for();
}

TEST(CyclicLoop, StopsWithoutWorkWhenToldBeforehand) {
  PlannedLoop planned;
  const std::atomic<bool> stop{true};
  planned.loop.run(stop, [](const Cycle&) { FAIL(); });
  EXPECT_EQ(planned.loop.stats().cycles, 0U);
  EXPECT_EQ(planned.loop.stats().missed, 0U);
}

TEST(CyclicLoop, RefusesPeriodOfZero) {
  EXPECT_THROW(CyclicLoop<>(0), std::invalid_argument);
  EXPECT_THROW(CyclicLoop<>(-1), std::invalid_argument);
}

// On the real clock: however late this machine is, every period is either run or counted.
TEST(CyclicLoop, AccountsForEveryPeriodOfRealTime) {
  constexpr std::int64_t kMillisecond = 1'000'000;
  CyclicLoop<> loop(kMillisecond);
  std::atomic<bool> stop{false};
  std::int64_t early = 0;
  const std::int64_t before_ns = MonotonicClock::now_ns();
  loop.run(stop, [&](const Cycle& cycle) {
    early += cycle.woken_ns < cycle.deadline_ns ? 1 : 0;
    if (cycle.index % 20 == 0) {  // an overrun of two periods at least
      MonotonicClock::sleep_until(MonotonicClock::now_ns() + 5 * kMillisecond / 2);
    }
    stop.store(cycle.index >= 200);
  });
  const CycleStats& stats = loop.stats();
  EXPECT_EQ(early, 0);
  EXPECT_GE(stats.first_deadline_ns, before_ns + kMillisecond);
  EXPECT_EQ(static_cast<std::int64_t>(stats.cycles + stats.missed),
            (stats.last_woken_ns - stats.first_deadline_ns) / kMillisecond + 1);
  EXPECT_GE(stats.missed, 1U);
  EXPECT_GE(stats.overruns, 1U);
  EXPECT_EQ(stats.execution_time.count(), stats.cycles);
  EXPECT_EQ(stats.wakeup_latency.count(), stats.cycles - stats.overruns);
}

// Under ThreadSanitizer this also proves that snapshots are taken without a race.
TEST(CyclicLoop, AnotherThreadSeesWholeSnapshots) {
  CyclicLoop<> loop(100'000);
  TripleBuffer<CycleStats> shown;
  std::atomic<bool> stop{false};
  std::thread looping([&] { loop.run(stop, [&](const Cycle&) { shown.write(loop.stats()); }); });
  std::uint64_t inconsistent = 0;
  for (int seen = 0; seen < 50;) {
    if (!shown.update()) {
      std::this_thread::yield();
      continue;
    }
    ++seen;
    const CycleStats& stats = shown.read();
    const std::int64_t begun =
        (stats.last_woken_ns - stats.first_deadline_ns) / stats.period_ns + 1;
    inconsistent += static_cast<std::int64_t>(stats.cycles + stats.missed) != begun ? 1 : 0;
    inconsistent += stats.wakeup_latency.count() + stats.overruns != stats.cycles ? 1 : 0;
    inconsistent += stats.execution_time.count() + 1 != stats.cycles ? 1 : 0;
  }
  stop.store(true);
  looping.join();
  EXPECT_EQ(inconsistent, 0U);
}

}  // namespace
}  // namespace topoloc::realtime

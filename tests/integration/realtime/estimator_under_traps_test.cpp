// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/estimator.hpp"
#include "topoloc/realtime/cyclic_loop.hpp"
#include "topoloc/realtime/forbid_blocking.hpp"
#include "topoloc/realtime/memory_lock.hpp"
#include "topoloc/realtime/spsc_ring.hpp"
#include "topoloc/realtime/thread.hpp"
#include "topoloc/realtime/triple_buffer.hpp"

#include "support/straight_drive.hpp"

#include <array>
#include <atomic>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::realtime {
namespace {

using estimation::Estimate;
using estimation::Estimator;
using estimation::EstimatorConfig;
using estimation::ImuSample;
using estimation::kMaxMatchedNodes;
using estimation::kMaxMatches;
using estimation::MapMatchSet;
using estimation::SpeedSample;
using estimation::TickInputs;
using test::StraightDrive;

constexpr double kTick_s = 0.005;
constexpr int kImuPerTick = 5;    // 1000 Hz
constexpr int kSpeedPerTick = 1;  // 200 Hz: with the IMU more than the ring holds for its duration
constexpr double kLate_s = 0.8;   // nearly all that the ring holds is computed again

/// A full set: as many matches and nodes as there can be, the nodes uncertain and never used
/// before.
void fill(const StraightDrive& drive, double frame_s, int number, MapMatchSet& set) {
  drive.matches(frame_s, kMaxMatches, set);
  set.node_count = kMaxMatchedNodes;
  for (int n = 0; n < kMaxMatchedNodes; ++n) {
    estimation::MatchedNode& node = set.nodes[static_cast<std::size_t>(n)];
    node = set.nodes[0];
    node.node_id = static_cast<std::uint32_t>(kMaxMatchedNodes * number + n);
    node.covariance = 1e-4 * Eigen::Matrix<double, 6, 6>::Identity();
  }
  for (int i = 0; i < set.match_count; ++i) {
    set.matches[static_cast<std::size_t>(i)].node_slot = i % kMaxMatchedNodes;
  }
}

struct Tick {
  std::array<ImuSample, kImuPerTick> imu;
  std::array<SpeedSample, kSpeedPerTick> speed;
  std::int64_t now_ns = 0;
};

Tick inputs_of(const StraightDrive& drive, std::int64_t k) {
  Tick tick;
  const double start_s = kTick_s * static_cast<double>(k);
  for (int i = 0; i < kImuPerTick; ++i) {
    tick.imu[static_cast<std::size_t>(i)] =
        StraightDrive::imu(start_s + kTick_s * (i + 1) / kImuPerTick);
  }
  for (int i = 0; i < kSpeedPerTick; ++i) {
    tick.speed[static_cast<std::size_t>(i)] =
        drive.speed(start_s + kTick_s * (i + 1) / kSpeedPerTick);
  }
  tick.now_ns = tick.imu.back().time_ns;
  return tick;
}

EstimatorConfig config_of(const StraightDrive& drive) {
  EstimatorConfig config;
  config.models.camera = drive.camera;
  config.models.imu_rate_hz = kImuPerTick / kTick_s;
  return config;
}

class EstimatorUnderTraps : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!kTrapsBuiltIn) {
      GTEST_SKIP() << "built without TOPOLOC_RT_TRAPS";
    }
  }
};

// Full ring, full match sets as late as may be, and a restart; from the first tick on.
TEST_F(EstimatorUnderTraps, NeitherAllocatesNorLocksWithEverythingFull) {
  const StraightDrive drive;
  Estimator estimator(config_of(drive));
  std::vector<MapMatchSet> sets(20);
  for (std::size_t k = 0; k < sets.size(); ++k) {
    fill(drive, 0.15 + 0.1 * static_cast<double>(k), static_cast<int>(k), sets[k]);
  }
  std::size_t next_set = 0;
  std::size_t told = 0;
  bool ring_full = false;
  Estimate estimate;
  for (std::int64_t k = 0; k < 600; ++k) {
    const Tick tick = inputs_of(drive, k);
    const ForbidBlocking forbid;
    std::array<const MapMatchSet*, 1> due{};
    std::size_t due_count = 0;
    if (next_set < sets.size() &&
        sets[next_set].frame_time_ns + std::llround(kLate_s * 1e9) <= tick.now_ns) {
      due[0] = &sets[next_set++];
      due_count = 1;
    }
    TickInputs inputs{.imu = tick.imu,
                      .speed = tick.speed,
                      .matches = {due.data(), due_count},
                      .initial_pose = {}};
    if (k == 0 || k == 590) {
      inputs.initial_pose = {.time_ns = tick.imu[0].time_ns,
                             .T_world_imu = drive.pose(kTick_s * static_cast<double>(k))};
    }
    estimate = estimator.tick(tick.now_ns, inputs);
    told += estimator.map_reports().size();
    estimation::Covariance P;
    // 1024 events of 1200 a second: that far back only the ring's size is in the way.
    const bool reaches_back = estimator.state_at(tick.now_ns - 900'000'000, P).has_value();
    ring_full = ring_full || (k > 250 && !reaches_back);
  }
  EXPECT_EQ(estimate.counters.map_accepted(), sets.size());
  EXPECT_GE(told, sets.size());
  EXPECT_TRUE(ring_full);
  EXPECT_NEAR(estimate.state.p_world_imu.x(), drive.speed_mps * kTick_s * 600, 1.0);
}

// As in the vehicle: a cyclic thread that is fed by rings and shows its state in a triple buffer.
TEST_F(EstimatorUnderTraps, CyclicThreadRunsOnRingsAloneWithoutPageFaults) {
  constexpr std::int64_t kTicks = 300;
  const StraightDrive drive;
  Estimator estimator(config_of(drive));
  SpscRing<Tick> ticks(16);
  SpscRing<MapMatchSet> matches(4);
  TripleBuffer<Estimate> shown;
  CyclicLoop<> loop(static_cast<std::int64_t>(kTick_s * 1e9));
  std::atomic<bool> stop{false};
  PageFaults faults;
  std::int64_t done = 0;

  const auto step = [&](const Tick& tick) {
    std::array<const MapMatchSet*, 1> due{matches.read_slot()};
    TickInputs inputs{.imu = tick.imu,
                      .speed = tick.speed,
                      .matches = {due.data(), due[0] == nullptr ? 0U : 1U},
                      .initial_pose = {}};
    if (done == 0) {
      inputs.initial_pose = {.time_ns = tick.imu[0].time_ns, .T_world_imu = drive.pose(0.0)};
    }
    shown.write(estimator.tick(tick.now_ns, inputs));
    if (due[0] != nullptr) {
      matches.commit_read();
    }
  };
  Thread thread({.name = "estimator", .fifo_priority = 1}, [&] {
    const ForbidBlocking forbid;
    const PageFaults before = thread_page_faults();
    loop.run(stop, [&](const Cycle&) {
      while (const Tick* tick = ticks.read_slot()) {
        step(*tick);
        ticks.commit_read();
        ++done;
      }
    });
    faults = thread_page_faults();
    faults.minor -= before.minor;
    faults.major -= before.major;
  });
  const MemoryLock lock = lock_memory();
  thread.start();

  // This thread plays the sensors and the matcher; it may wait, the rings do not.
  std::int64_t newest_ns = 0;
  bool went_back = false;
  std::uint64_t sets = 0;
  for (std::int64_t k = 0; k < kTicks;) {
    const double frame_s = kTick_s * static_cast<double>(k) - kLate_s;
    MapMatchSet* set = k % 20 == 0 && frame_s > 0.05 ? matches.write_slot() : nullptr;
    if (set != nullptr) {
      fill(drive, frame_s, static_cast<int>(k), *set);
      matches.commit_write();
      ++sets;
    }
    while (!ticks.try_push(inputs_of(drive, k))) {
      MonotonicClock::sleep_until(MonotonicClock::now_ns() + 1'000'000);
    }
    ++k;
    if (shown.update()) {
      went_back = went_back || shown.read().time_ns < newest_ns;
      newest_ns = shown.read().time_ns;
    }
  }
  while (ticks.size() > 0 || matches.size() > 0) {
    MonotonicClock::sleep_until(MonotonicClock::now_ns() + 1'000'000);
    // A match set that came after the last samples waits for another tick.
    if (matches.size() > 0 && ticks.size() == 0) {
      (void)ticks.try_push(inputs_of(drive, kTicks));
    }
  }
  stop.store(true);
  thread.join();
  unlock_memory();
  (void)shown.update();
  const Estimate& last = shown.read();
  EXPECT_GE(done, kTicks);
  EXPECT_FALSE(went_back);
  EXPECT_GE(sets, 1U);
  EXPECT_EQ(last.counters.map_accepted(), sets);
  EXPECT_EQ(
      loop.stats().cycles + loop.stats().missed,
      static_cast<std::uint64_t>((loop.stats().last_woken_ns - loop.stats().first_deadline_ns) /
                                     loop.stats().period_ns +
                                 1));
  if (lock.locked) {
    EXPECT_EQ(faults.minor, 0U);
    EXPECT_EQ(faults.major, 0U);
  }
}

}  // namespace
}  // namespace topoloc::realtime

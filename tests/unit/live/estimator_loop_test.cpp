// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/estimator_loop.hpp"

#include "topoloc/live/messages.hpp"

#include "support/scripted_bus.hpp"

#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::live {
namespace {

/// A bus whose frames the test hands out, stamped as just come in.
class ManualBus : public CanSource {
 public:
  void put(std::span<const can::Frame> frames) { frames_.assign(frames.begin(), frames.end()); }
  std::span<const can::Frame> receive() noexcept override {
    given_ = std::move(frames_);
    frames_.clear();
    return given_;
  }
  void system_clock_set(std::int64_t /*by_ns*/) noexcept override {}
  [[nodiscard]] can::CanCounters counters() const noexcept override { return {}; }

 private:
  std::vector<can::Frame> frames_;
  std::vector<can::Frame> given_;
};

class EstimatorLoopTest : public ::testing::Test {
 protected:
  EstimatorLoopTest()
      : signals_(car_.vehicle.can),
        loop_({.estimator = car_.vehicle.estimator, .journal = true}, clock_, signals_, bus_,
              ports_) {
    shift_ns_ = clock_.now_ns() - car_.frames.front().time_ns;
  }

  /// A tick with the frames of the car's next samples.
  const TickOutput& tick(int samples) {
    constexpr std::size_t kFramesPerSample = 4;
    std::vector<can::Frame> frames;
    for (std::size_t i = 0; i < kFramesPerSample * static_cast<std::size_t>(samples); ++i) {
      frames.push_back(car_.frames.at(next_++));
      frames.back().time_ns += shift_ns_;
    }
    bus_.put(frames);
    return loop_.tick(number_++);
  }
  [[nodiscard]] std::int64_t newest_ns() const {
    return car_.frames.at(next_ - 1).time_ns + shift_ns_;
  }
  EstimatorStatus status() {
    EstimatorStatus status;
    loop_.report(status);
    return status;
  }

  DrivenCar car_{200};
  HostClock clock_;
  std::int64_t shift_ns_ = 0;
  can::VehicleSignals signals_;
  ManualBus bus_;
  EstimatorPorts ports_;
  EstimatorLoop loop_;
  std::size_t next_ = 0;
  std::uint64_t number_ = 0;
};

RigidTransform at(double x_m) { return {Eigen::Matrix3d::Identity(), {x_m, 0.0, 0.0}}; }

TEST_F(EstimatorLoopTest, StartsFromAPoseOfNowOnceTheDataIsThere) {
  loop_.start_from(at(100.0));
  for (int i = 0; i < 20; ++i) {
    EXPECT_FALSE(has_pose(tick(0)));
  }
  tick(2);
  const TickOutput& output = tick(1);
  ASSERT_TRUE(has_pose(output));
  EXPECT_EQ(output.estimate.counters.starts, 1U);
  EXPECT_NEAR(output.estimate.state.p_world_imu.x(), 100.0, 1.0);
  EXPECT_NEAR(output.estimate.state.v_world_imu.x(), DrivenCar::kSpeed_mps, 1e-2);
  tick(1);
  EXPECT_EQ(tick(1).estimate.counters.starts, 1U);
}

TEST_F(EstimatorLoopTest, EveryFrameIsUsedOnceAndEverySampleReachesTheFilter) {
  constexpr int kBeforeStart = 3;
  const auto before_start = static_cast<std::size_t>(estimation::InsertVerdict::kBeforeStart);
  tick(kBeforeStart);
  EXPECT_TRUE(ports_.poses.try_push({std::nullopt, at(40.0)}));
  tick(1);  // the filter starts from its inertial sample
  const estimation::Counters& c = tick(5).estimate.counters;
  const can::SignalCounts counts = status().signal_counts;
  EXPECT_EQ(counts.used, next_);
  EXPECT_EQ(counts.imu_samples, 9U);
  EXPECT_EQ(c.imu[before_start], kBeforeStart + 1U);
  EXPECT_EQ(std::reduce(c.imu.begin(), c.imu.end()), counts.imu_samples);
  EXPECT_EQ(std::reduce(c.speed.begin(), c.speed.end()), counts.speed_samples);
}

TEST_F(EstimatorLoopTest, TakesNoMoreFramesATickThanItsBound) {
  loop_.start_from(at(0.0));
  tick(5);
  const std::uint64_t used = status().signal_counts.used;
  constexpr std::uint64_t kGiven = 4 * 30;  // by a bus that does not keep to the bound
  tick(30);
  EXPECT_EQ(status().signal_counts.used - used, kMaxFramesPerTick);
  EXPECT_EQ(status().over_tick, kGiven - kMaxFramesPerTick);
}

TEST_F(EstimatorLoopTest, StartsAnewFromAPoseThatComesIn) {
  loop_.start_from(at(100.0));
  tick(10);
  ASSERT_TRUE(ports_.poses.try_push({.time_ns = std::nullopt, .T_world_imu = at(500.0)}));
  tick(2);
  EXPECT_NEAR(tick(1).estimate.state.p_world_imu.x(), 500.0, 1.0);
  EXPECT_EQ(tick(1).estimate.counters.starts, 2U);
}

TEST_F(EstimatorLoopTest, TakesAPoseOfAGivenTimeOnce) {
  tick(5);
  ASSERT_TRUE(ports_.poses.try_push({.time_ns = newest_ns(), .T_world_imu = at(0.0)}));
  tick(1);
  const TickOutput& output = tick(5);
  ASSERT_TRUE(has_pose(output));
  EXPECT_EQ(output.estimate.counters.starts, 1U);
}

TEST_F(EstimatorLoopTest, TellsTheMatcherWhereTheVehicleWas) {
  loop_.start_from(at(0.0));
  tick(10);
  const std::int64_t asked_ns = newest_ns() - 50'000'000;
  ASSERT_TRUE(ports_.asked.try_push(asked_ns));
  tick(1);
  FramePrediction prediction;
  ASSERT_TRUE(ports_.predictions.try_pop(prediction));
  EXPECT_EQ(prediction.time_ns, asked_ns);
  ASSERT_TRUE(prediction.known);
  EXPECT_NEAR(prediction.v_world_mps.x(), DrivenCar::kSpeed_mps, 1e-2);
  estimation::Covariance P;
  const double now_m = tick(1).estimate.state.p_world_imu.x();
  EXPECT_GT(now_m - prediction.pose.T_world_imu.p.x(), 0.5 * 0.05 * DrivenCar::kSpeed_mps);
}

TEST_F(EstimatorLoopTest, KnowsNothingBeforeTheStart) {
  ASSERT_TRUE(ports_.asked.try_push(clock_.now_ns()));
  tick(1);
  FramePrediction prediction;
  ASSERT_TRUE(ports_.predictions.try_pop(prediction));
  EXPECT_FALSE(prediction.known);
}

TEST_F(EstimatorLoopTest, TakesOneMatchSetATickAndNamesItInTheJournal) {
  loop_.start_from(at(0.0));
  tick(10);
  for (std::uint64_t number = 0; number < 3; ++number) {
    NumberedMatchSet* const slot = ports_.match_sets.write_slot();
    ASSERT_NE(slot, nullptr);
    slot->number = number;
    slot->set.frame_time_ns = newest_ns() - 1000 * static_cast<std::int64_t>(3 - number);
    ports_.match_sets.commit_write();
  }
  RecordedTick recorded;
  while (ports_.journal.try_pop(recorded)) {
    EXPECT_FALSE(recorded.input.match_set);
  }
  for (std::uint64_t number = 0; number < 3; ++number) {
    tick(1);
    ASSERT_TRUE(ports_.journal.try_pop(recorded));
    EXPECT_EQ(recorded.input.match_set, number);
  }
  EXPECT_EQ(tick(1).estimate.counters.map_rejected(), 3U);  // without a match in them
}

TEST_F(EstimatorLoopTest, TellsTheJournalWhereTheVehicleWas) {
  RecordedTick recorded;
  tick(10);
  ASSERT_TRUE(ports_.journal.try_pop(recorded));
  EXPECT_FALSE(recorded.pose);
  ASSERT_TRUE(ports_.poses.try_push({std::nullopt, at(100.0)}));
  const estimation::Estimate& estimate = tick(1).estimate;
  ASSERT_TRUE(ports_.journal.try_pop(recorded));
  ASSERT_TRUE(recorded.pose);
  EXPECT_EQ(recorded.pose->time_ns, estimate.time_ns);
  EXPECT_EQ(recorded.pose->T_world_imu.p, estimate.state.p_world_imu);
}

TEST_F(EstimatorLoopTest, CountsWhatSlowReadersDoNotTake) {
  for (std::size_t i = 0; i < EstimatorPorts::kTicks + 5; ++i) {
    tick(0);
  }
  EXPECT_EQ(status().losses.outputs, 5U);
  EXPECT_EQ(status().losses.journal, 5U);
}

TEST_F(EstimatorLoopTest, ItsInputsMakeTheSameEstimatesBitForBit) {
  loop_.start_from(at(3.0));
  std::vector<estimate_t> published;
  for (int i = 0; i < 100; ++i) {
    published.push_back(to_estimate(tick(i % 3 == 0 ? 2 : 1)));
  }
  TickRunner again(car_.vehicle.estimator);
  RecordedTick recorded;
  for (const estimate_t& expected : published) {
    ASSERT_TRUE(ports_.journal.try_pop(recorded));
    const estimate_t found = to_estimate(again.run(recorded.input, nullptr));
    std::vector<char> a(static_cast<std::size_t>(found.getEncodedSize()));
    std::vector<char> b(a.size());
    found.encode(a.data(), 0, static_cast<int>(a.size()));
    expected.encode(b.data(), 0, static_cast<int>(b.size()));
    ASSERT_EQ(a, b) << "tick " << expected.tick;
  }
}

TEST_F(EstimatorLoopTest, WithoutAPoseSaysThatNothingIsKnown) {
  const estimate_t message = to_estimate(tick(1));
  EXPECT_EQ(message.mode, estimate_t::MODE_UNINITIALISED);
  EXPECT_NE(message.reasons & estimate_t::REASON_NO_POSE, 0);
  EXPECT_GT(message.utime, 0);
  EXPECT_GE(message.covariance[0], 1e12);
}

}  // namespace
}  // namespace topoloc::live

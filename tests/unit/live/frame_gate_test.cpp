// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/frame_gate.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace topoloc::live {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kPeriod_ns = 100 * kMs;
constexpr std::int64_t kDelay_ns = 30 * kMs;

/// A camera whose clock can be wrong, 10 frames a second, each 30 ms on its way (some 5 ms more).
class FrameGateTest : public ::testing::Test {
 protected:
  /// The next frame, which is so much later than usual; returns its verdict.
  FrameStamp next(std::int64_t late_ns = 0) {
    exposed_ns_ += kPeriod_ns;
    received_ns_ = exposed_ns_ + kDelay_ns + (frame_++ % 3) * 2 * kMs + late_ns;
    time_ns_ =
        exposed_ns_ + std::llround(clock_rate_ * static_cast<double>(exposed_ns_)) + clock_ns_;
    return gate_.add(time_ns_, received_ns_);
  }
  void run(int frames) {
    for (int i = 0; i < frames; ++i) {
      ASSERT_EQ(next(), FrameStamp::kAccepted) << "frame " << frame_;
    }
  }
  [[nodiscard]] std::uint64_t count(FrameStamp stamp) const {
    return gate_.timing().stamps[static_cast<std::size_t>(stamp)];
  }
  /// How far the stamp of the last frame is off after correction.
  [[nodiscard]] std::int64_t error_ns() const { return time_ns_ - exposed_ns_; }

  FrameGate gate_{1000 * kMs};
  std::int64_t clock_ns_ = 0;  ///< error of the camera's clock
  double clock_rate_ = 0.0;
  std::int64_t exposed_ns_ = 0;
  std::int64_t received_ns_ = 0;
  std::int64_t time_ns_ = 0;
  int frame_ = 0;
};

TEST_F(FrameGateTest, AcceptsRegularFramesUnchanged) {
  run(200);
  EXPECT_EQ(error_ns(), 0);
  EXPECT_EQ(gate_.timing().steps, 0U);
  EXPECT_NEAR(gate_.timing().delay_ms, 30.0, 1e-9);
}

TEST_F(FrameGateTest, CorrectsAClockThatIsSetAheadOrBack) {
  for (const std::int64_t step_ns : {300 * kMs, -300 * kMs, 5000 * kMs, -5000 * kMs}) {
    run(100);
    const auto steps = gate_.timing().steps;
    clock_ns_ += step_ns;
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(next(), FrameStamp::kClockStep);
    }
    run(20);
    EXPECT_EQ(gate_.timing().steps, steps + 1);
    EXPECT_LE(std::abs(error_ns()), 5 * kMs);
  }
}

TEST_F(FrameGateTest, TurnsAwayASingleWrongStamp) {
  run(50);
  clock_ns_ = 400 * kMs;
  EXPECT_EQ(next(), FrameStamp::kClockStep);
  clock_ns_ = 0;
  run(50);
  EXPECT_EQ(gate_.timing().steps, 0U);
  EXPECT_EQ(error_ns(), 0);
}

TEST_F(FrameGateTest, AcceptsFramesThatAreLateWithTheirOwnStamps) {
  run(50);
  EXPECT_EQ(next(80 * kMs), FrameStamp::kAccepted);
  run(3);
  for (int i = 0; i < 30; ++i) {  // a queue that stays full
    EXPECT_EQ(next(250 * kMs), FrameStamp::kAccepted);
  }
  EXPECT_EQ(gate_.timing().steps, 0U);
  EXPECT_EQ(error_ns(), 0);
}

TEST_F(FrameGateTest, GoesOnAfterAPauseOfTheCamera) {
  run(50);
  exposed_ns_ += 60'000 * kMs;
  run(50);
  EXPECT_EQ(gate_.timing().steps, 0U);
}

TEST_F(FrameGateTest, CountsStampsThatCannotBe) {
  run(1);
  std::int64_t time_ns = received_ns_ + 500 * kMs;
  EXPECT_EQ(gate_.add(time_ns, received_ns_ + kPeriod_ns), FrameStamp::kFuture);
  time_ns = exposed_ns_;
  EXPECT_EQ(gate_.add(time_ns, received_ns_ + kPeriod_ns), FrameStamp::kNotMonotonic);
  time_ns = exposed_ns_ - 3000 * kMs;
  EXPECT_EQ(gate_.add(time_ns, received_ns_ + kPeriod_ns), FrameStamp::kTooOld);
  EXPECT_EQ(count(FrameStamp::kFuture), 1U);
  EXPECT_EQ(count(FrameStamp::kNotMonotonic), 1U);
  EXPECT_EQ(count(FrameStamp::kTooOld), 1U);
}

TEST_F(FrameGateTest, GoesOnWithACameraWhoseClockIsAhead) {
  clock_ns_ = 400 * kMs;
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(next(), FrameStamp::kFuture);
  }
  run(50);
  EXPECT_EQ(gate_.timing().steps, 1U);
  EXPECT_LE(std::abs(error_ns() - kDelay_ns), 5 * kMs);  // the delay itself cannot be known
}

TEST_F(FrameGateTest, GoesOnWithACameraWhoseClockIsFast) {
  clock_rate_ = 200e-6;  // 30 ms of delay are gone after 150 s
  for (int i = 0; i < 10'000; ++i) {
    next();
  }
  EXPECT_GE(count(FrameStamp::kAccepted), 9'500U);
  EXPECT_LE(received_ns_ - time_ns_, 45 * kMs);
  EXPECT_GE(received_ns_ - time_ns_, -10 * kMs);
}

TEST_F(FrameGateTest, TakesOneWrongStampAmongLateFramesForNoStep) {
  run(100);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(next(150 * kMs), FrameStamp::kAccepted);
  }
  clock_ns_ = 400 * kMs;
  EXPECT_EQ(next(150 * kMs), FrameStamp::kClockStep);
  clock_ns_ = 0;
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(next(150 * kMs), FrameStamp::kAccepted);
  }
  EXPECT_EQ(gate_.timing().steps, 0U);
  EXPECT_EQ(gate_.timing().late, 20U);
  EXPECT_EQ(error_ns(), 0);
}

TEST_F(FrameGateTest, TellsADriftOfTheCamerasClock) {
  clock_rate_ = -100e-6;  // slow: stamps fall behind
  run(3000);
  EXPECT_NEAR(gate_.timing().drift_ppm, 100.0, 10.0);
  EXPECT_EQ(gate_.timing().steps, 0U);
}

}  // namespace
}  // namespace topoloc::live

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/frame_gate.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

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

TEST_F(FrameGateTest, CorrectsAClockThatIsSetByLessThanAPeriod) {
  for (const std::int64_t step_ns : {-80 * kMs, 80 * kMs}) {
    run(100);
    clock_ns_ += step_ns;
    for (int i = 0; i < 4; ++i) {
      EXPECT_EQ(next(), FrameStamp::kClockStep);
    }
    run(20);
    EXPECT_LE(std::abs(error_ns()), 5 * kMs);
  }
  EXPECT_EQ(gate_.timing().steps, 2U);
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

/// Where nothing happens for a while, and then at once all that was due meanwhile.
class Stalls {
 public:
  Stalls(std::uint64_t seed, double mean_pause_s, double longest_s)
      : random_(seed), pause_s_(1.0 / mean_pause_s), length_s_(0.1, longest_s) {}

  /// When what is due at a time is done. Times may not go back.
  std::int64_t done_ns(std::int64_t due_ns) {
    while (due_ns > until_ns_) {
      from_ns_ = until_ns_ + std::llround(1e9 * pause_s_(random_));
      until_ns_ = from_ns_ + std::llround(1e9 * length_s_(random_));
    }
    return due_ns < from_ns_ ? due_ns : until_ns_;
  }

 private:
  std::mt19937_64 random_;
  std::exponential_distribution<double> pause_s_;
  std::uniform_real_distribution<double> length_s_;
  std::int64_t from_ns_ = 0;
  std::int64_t until_ns_ = 0;
};

struct Starvation {
  std::uint64_t seed = 0;
  double period_s = 0.1;
  double mean_pause_s = 1.0;  ///< between stalls
  double longest_s = 1.0;     ///< of a stall
  bool loses_frames = false;  ///< what waits is lost but for the first three
  double jitter_s = 0.003;    ///< mean of what each of sender and receiver is late
};

/// A camera whose clock can be wrong, on a machine without time: its frames are sent late and
/// received late, those of a stall all at once.
class StarvedCamera {
 public:
  explicit StarvedCamera(const Starvation& s)
      : s_(s),
        sender_(s.seed, s.mean_pause_s, s.longest_s),
        receiver_(s.seed + 1000, s.mean_pause_s, s.longest_s),
        random_(s.seed + 2000),
        jitter_s_(1.0 / s.jitter_s) {}

  void run(double seconds) {
    const std::int64_t until_ns = exposed_ns_ + std::llround(1e9 * seconds);
    while (exposed_ns_ < until_ns) {
      next();
    }
  }

  /// A frame with a wrong stamp, and those after it.
  void run_with_a_wrong_stamp(std::int64_t error_ns, double seconds) {
    const std::uint64_t before = received;
    clock_ns += error_ns;
    while (received == before) {
      next();
    }
    clock_ns -= error_ns;
    run(seconds);
  }
  void set_period(double period_s) { s_.period_s = period_s; }

  FrameGate gate{1000 * kMs};
  std::int64_t clock_ns = 0;  ///< error of the camera's clock
  std::uint64_t received = 0;
  std::uint64_t wrong = 0;  ///< accepted with a stamp that is off by more than 30 ms

  [[nodiscard]] std::uint64_t count(FrameStamp stamp) const {
    return gate.timing().stamps[static_cast<std::size_t>(stamp)];
  }
  /// By how much corrected stamps are off.
  [[nodiscard]] double error_s() const {
    return 1e-9 * static_cast<double>(clock_ns) + gate.timing().correction_s;
  }

 private:
  void next() {
    exposed_ns_ += std::llround(1e9 * s_.period_s);
    const std::int64_t sent_ns = sender_.done_ns(exposed_ns_ + jitter_ns());
    const std::int64_t received_ns =
        receiver_.done_ns(std::max(last_received_ns_, sent_ns + 20 * kMs + jitter_ns()));
    waiting_ = received_ns == last_received_ns_ ? waiting_ + 1 : 0;
    last_received_ns_ = received_ns;
    if (s_.loses_frames && waiting_ > 3) {
      return;
    }
    ++received;
    std::int64_t time_ns = exposed_ns_ + clock_ns;
    if (gate.add(time_ns, received_ns) == FrameStamp::kAccepted) {
      wrong += std::abs(time_ns - exposed_ns_) > 30 * kMs ? 1 : 0;
    }
  }
  std::int64_t jitter_ns() { return std::llround(1e9 * jitter_s_(random_)); }

  Starvation s_;
  Stalls sender_;
  Stalls receiver_;
  std::mt19937_64 random_;
  std::exponential_distribution<double> jitter_s_;
  std::int64_t exposed_ns_ = 0;
  std::int64_t last_received_ns_ = 0;
  int waiting_ = 0;
};

class StarvedFrameGateTest : public ::testing::TestWithParam<Starvation> {};

TEST_P(StarvedFrameGateTest, TakesNoStallForAClockStep) {
  StarvedCamera camera(GetParam());
  camera.run(300.0);
  EXPECT_EQ(camera.gate.timing().correction_s, 0.0);
  EXPECT_EQ(camera.gate.timing().steps, 0U);
  EXPECT_LE(camera.count(FrameStamp::kClockStep), camera.received / 100);
  EXPECT_EQ(camera.count(FrameStamp::kFuture), 0U);
  EXPECT_EQ(camera.count(FrameStamp::kNotMonotonic), 0U);
  EXPECT_EQ(camera.wrong, 0U);
}

// However bad it is, what was set is made up for.
TEST_P(StarvedFrameGateTest, FindsClockSteps) {
  StarvedCamera camera(GetParam());
  for (const std::int64_t step_ns : {300 * kMs, -300 * kMs, 5000 * kMs, -5000 * kMs}) {
    // Where as much is lost at the same time, the stamps go on as if they were late.
    if (GetParam().loses_frames && step_ns == -300 * kMs) {
      camera.clock_ns = -std::llround(1e9 * camera.gate.timing().correction_s);
      continue;
    }
    camera.run(30.0);
    camera.clock_ns += step_ns;
    camera.run(20.0);
    EXPECT_NEAR(camera.error_s(), 0.0, 0.03) << "step by " << 1e-9 * static_cast<double>(step_ns);
  }
  EXPECT_LE(camera.wrong, camera.received / 20);
}

TEST_P(StarvedFrameGateTest, TurnsAwaySingleWrongStamps) {
  StarvedCamera camera(GetParam());
  camera.run(10.0);
  std::uint64_t wrong_stamps = 0;
  for (int i = 0; i < 10; ++i) {
    for (const std::int64_t error_ns : {400 * kMs, -400 * kMs, 3000 * kMs, -3000 * kMs}) {
      camera.run_with_a_wrong_stamp(error_ns, 2.0);
      ++wrong_stamps;
    }
  }
  EXPECT_EQ(camera.gate.timing().correction_s, 0.0);
  EXPECT_EQ(camera.gate.timing().steps, 0U);
  // One that is taken for late makes those after it go back.
  EXPECT_LE(camera.count(FrameStamp::kClockStep) + camera.count(FrameStamp::kFuture),
            10U * wrong_stamps);
}

TEST_P(StarvedFrameGateTest, TakesAnotherFrameRateForNoClockStep) {
  StarvedCamera camera(GetParam());
  for (int i = 0; i < 10; ++i) {
    for (const double factor : {1.0, 0.5, 2.0}) {
      camera.set_period(factor * GetParam().period_s);
      camera.run(5.0);
    }
  }
  EXPECT_EQ(camera.gate.timing().correction_s, 0.0);
  EXPECT_EQ(camera.gate.timing().steps, 0U);
  EXPECT_LE(camera.count(FrameStamp::kClockStep), camera.received / 100);
}

std::vector<Starvation> starvations() {
  std::vector<Starvation> all;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    for (const double period_s : {0.033, 0.1, 0.207}) {
      for (const double mean_pause_s : {0.5, 3.0}) {
        for (const bool loses_frames : {false, true}) {
          all.push_back({.seed = seed,
                         .period_s = period_s,
                         .mean_pause_s = mean_pause_s,
                         .loses_frames = loses_frames});
        }
      }
      all.push_back({.seed = seed, .period_s = period_s, .mean_pause_s = 20.0, .jitter_s = 0.015});
    }
  }
  return all;
}

std::string named(const ::testing::TestParamInfo<Starvation>& info) {
  const Starvation& s = info.param;
  return "Seed" + std::to_string(s.seed) + "Period" +
         std::to_string(std::lround(1e3 * s.period_s)) + "msStallsEvery" +
         std::to_string(std::lround(1e3 * s.mean_pause_s)) + "ms" +
         (s.loses_frames ? "WithLoss" : "");
}

INSTANTIATE_TEST_SUITE_P(Seeds, StarvedFrameGateTest, ::testing::ValuesIn(starvations()), named);

}  // namespace
}  // namespace topoloc::live

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/hardware_clock.hpp"

#include <random>

#include <gtest/gtest.h>

namespace topoloc::can {
namespace {

constexpr std::int64_t kUnix_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kTick_ns = 1'000'000;  // a millisecond

TEST(HardwareClock, TakesAwayTheKernelsDelays) {
  HardwareClock clock;
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int64_t> delay_ns(5'000, 4 * kTick_ns);
  std::int64_t worst_ns = 0;
  for (int i = 0; i < 10'000; ++i) {
    const std::int64_t hardware_ns = i * 10 * kTick_ns;
    const std::int64_t true_ns = kUnix_ns + hardware_ns + hardware_ns / 20'000;  // 50e-6 fast
    const std::int64_t software_ns = true_ns + delay_ns(random);
    const std::int64_t time_ns = clock.unix_ns(hardware_ns, software_ns);
    EXPECT_LE(time_ns, software_ns);
    if (i > 100) {
      worst_ns = std::max(worst_ns, std::abs(time_ns - true_ns));
    }
  }
  EXPECT_LT(worst_ns, 300'000);
}

TEST(HardwareClock, NeverGoesBackWhileBothClocksGoOn) {
  HardwareClock clock;
  std::mt19937 random(2);
  std::uniform_int_distribution<std::int64_t> delay_ns(0, 900'000);
  std::int64_t last_ns = 0;
  for (int i = 0; i < 10'000; ++i) {
    const std::int64_t hardware_ns = i * kTick_ns;
    const auto time_ns = clock.unix_ns(hardware_ns, kUnix_ns + hardware_ns + delay_ns(random));
    EXPECT_GT(time_ns, last_ns);
    last_ns = time_ns;
  }
}

TEST(HardwareClock, FollowsWhenTheSystemsClockIsSet) {
  HardwareClock clock;
  EXPECT_EQ(clock.unix_ns(1000, kUnix_ns), kUnix_ns);
  const std::int64_t hour_ns = 3'600'000 * kTick_ns;
  EXPECT_EQ(clock.unix_ns(2000, kUnix_ns + hour_ns), kUnix_ns + hour_ns);
  EXPECT_EQ(clock.unix_ns(3000, kUnix_ns - hour_ns), kUnix_ns - hour_ns);
}

class SteppedAhead : public ::testing::TestWithParam<std::int64_t> {};

// So small that it could be a delay.
TEST_P(SteppedAhead, FollowsAtOnceWhenItIsTold) {
  const std::int64_t step_ns = GetParam();
  HardwareClock clock;
  std::mt19937 random(3);
  std::uniform_int_distribution<std::int64_t> delay_ns(0, 200'000);
  std::int64_t set_ns = 0;
  std::int64_t worst_ns = 0;
  for (int i = 0; i < 2000; ++i) {
    if (i == 1000) {
      clock.system_clock_set(step_ns);
    }
    if (i == 1003) {  // before it the kernel had stamped some frames more
      set_ns = step_ns;
    }
    const std::int64_t hardware_ns = i * 5 * kTick_ns;
    const std::int64_t true_ns = kUnix_ns + hardware_ns + set_ns;
    const std::int64_t time_ns = clock.unix_ns(hardware_ns, true_ns + delay_ns(random));
    worst_ns = std::max(worst_ns, std::abs(time_ns - true_ns));
  }
  EXPECT_LE(worst_ns, 200'000);
}

INSTANTIATE_TEST_SUITE_P(HardwareClock, SteppedAhead,
                         ::testing::Values(2 * kTick_ns, 30 * kTick_ns, 49 * kTick_ns));

TEST(HardwareClock, ForgetsAStepThatWasTakenBack) {
  HardwareClock clock;
  EXPECT_EQ(clock.unix_ns(0, kUnix_ns), kUnix_ns);
  clock.system_clock_set(30 * kTick_ns);
  clock.system_clock_set(-30 * kTick_ns);
  const std::int64_t delayed_ns = kUnix_ns + 40 * kTick_ns;
  EXPECT_LT(clock.unix_ns(5 * kTick_ns, delayed_ns), kUnix_ns + 6 * kTick_ns);
}

// So great that a frame shows it before it is told.
TEST(HardwareClock, ForgetsAStepThatItHasFollowedAlready) {
  HardwareClock clock;
  constexpr std::int64_t kStep_ns = 60 * kTick_ns;
  EXPECT_EQ(clock.unix_ns(0, kUnix_ns), kUnix_ns);
  const std::int64_t set_ns = kUnix_ns + kStep_ns;
  EXPECT_EQ(clock.unix_ns(5 * kTick_ns, set_ns + 5 * kTick_ns), set_ns + 5 * kTick_ns);
  clock.system_clock_set(kStep_ns);
  std::int64_t hardware_ns = 10 * kTick_ns;
  for (; hardware_ns < 1100 * kTick_ns; hardware_ns += 5 * kTick_ns) {
    EXPECT_EQ(clock.unix_ns(hardware_ns, set_ns + hardware_ns), set_ns + hardware_ns);
  }
  const std::int64_t delay_ns = 40 * kTick_ns;
  EXPECT_LT(clock.unix_ns(hardware_ns, set_ns + hardware_ns + delay_ns),
            set_ns + hardware_ns + kTick_ns);
}

TEST(HardwareClock, FollowsAStepAlthoughTheBusWasSilentForLong) {
  HardwareClock clock;
  constexpr std::int64_t kStep_ns = 30 * kTick_ns;
  EXPECT_EQ(clock.unix_ns(0, kUnix_ns), kUnix_ns);
  clock.system_clock_set(kStep_ns);
  const std::int64_t hardware_ns = 3000 * kTick_ns;
  const std::int64_t before_ns = kUnix_ns + hardware_ns;  // the kernel's stamp
  EXPECT_EQ(clock.unix_ns(hardware_ns, before_ns), before_ns);
  const std::int64_t time_ns =
      clock.unix_ns(hardware_ns + kTick_ns, before_ns + kTick_ns + kStep_ns);
  EXPECT_NEAR(static_cast<double>(time_ns - before_ns), static_cast<double>(kTick_ns + kStep_ns),
              1e3);
}

TEST(HardwareClock, FollowsWhenTheControllerStartsAnew) {
  HardwareClock clock;
  clock.unix_ns(5'000 * kTick_ns, kUnix_ns);
  EXPECT_EQ(clock.unix_ns(7, kUnix_ns + kTick_ns), kUnix_ns + kTick_ns);
  EXPECT_EQ(clock.unix_ns(8, kUnix_ns + 2 * kTick_ns), kUnix_ns + kTick_ns + 1);
}

}  // namespace
}  // namespace topoloc::can

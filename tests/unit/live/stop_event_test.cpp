// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "live/stop_event.hpp"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace topoloc::live {
namespace {

using namespace std::chrono_literals;

constexpr int kForever = -1;

TEST(StopEvent, WakesAllWhoSleepOnIt) {
  StopEvent stop;
  EXPECT_FALSE(stop.wait(0));
  std::jthread first([&] { EXPECT_TRUE(stop.wait(kForever)); });
  std::jthread second([&] { EXPECT_TRUE(stop.wait(kForever)); });
  std::this_thread::sleep_for(10ms);
  stop.set();
  first.join();
  second.join();
  EXPECT_TRUE(stop.wait(kForever));
}

TEST(StopEvent, LetsAnotherWakeItsSleeper) {
  const StopEvent stop;
  const WakeEvent other;
  eventfd_write(other.fd(), 1);
  EXPECT_FALSE(stop.wait(kForever, other.fd()));
}

}  // namespace
}  // namespace topoloc::live

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/imu_screen.hpp"

#include <gtest/gtest.h>

namespace topoloc::estimation {
namespace {

class ImuScreenTest : public ::testing::Test {
 protected:
  bool believes(double force_z_mps2, double rate_z_radps = 0.0) {
    time_ns_ += 10'000'000;
    return screen_.believes({.time_ns = time_ns_,
                             .specific_force_mps2 = {0.0, 0.0, force_z_mps2},
                             .angular_rate_radps = {0.0, 0.0, rate_z_radps}});
  }

  ImuScreen screen_{ImuScreenConfig{}};
  std::int64_t time_ns_ = 0;
};

TEST_F(ImuScreenTest, BelievesWhatAVehicleDoes) {
  for (const double force : {9.8, 30.0, -5.0, 9.8, 12.0}) {
    EXPECT_TRUE(believes(force, 0.1 * force / 9.8));
  }
}

TEST_F(ImuScreenTest, DoubtsASampleThatLeapsAndComesBack) {
  EXPECT_TRUE(believes(9.8));
  EXPECT_FALSE(believes(9.8, 2.6));
  EXPECT_TRUE(believes(9.8));
  EXPECT_FALSE(believes(60.0));
  EXPECT_FALSE(believes(-40.0));
  EXPECT_TRUE(believes(9.8));
}

TEST_F(ImuScreenTest, BelievesALeapThatLasts) {
  EXPECT_TRUE(believes(9.8));
  EXPECT_FALSE(believes(9.8, 1.5));
  EXPECT_TRUE(believes(9.8, 1.6));
  EXPECT_TRUE(believes(9.8, 1.4));
}

TEST_F(ImuScreenTest, NeverBelievesTheImpossible) {
  for (int i = 0; i < 10; ++i) {
    EXPECT_FALSE(believes(100.0));
    EXPECT_FALSE(believes(9.8, -10.0));
  }
}

TEST_F(ImuScreenTest, KnowsNothingAfterAGap) {
  EXPECT_TRUE(believes(9.8));
  time_ns_ += 1'000'000'000;
  EXPECT_TRUE(believes(9.8, 1.5));
}

}  // namespace
}  // namespace topoloc::estimation

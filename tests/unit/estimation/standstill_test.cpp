// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/standstill.hpp"

#include <cmath>
#include <functional>

#include <gtest/gtest.h>

namespace topoloc::estimation {
namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;

/// Drives IMU (100 Hz) and speed (50 Hz) through the detector; gives the share of speed samples of
/// the last second at which the vehicle was said to stand.
double standing_share(const std::function<ImuSample(double t)>& imu,
                      const std::function<double(double t)>& speed) {
  StandstillDetector detector{StandstillModel{}};
  int standing = 0;
  int total = 0;
  for (int i = 0; i < 300; ++i) {
    const double t = 0.01 * i;
    ImuSample sample = imu(t);
    sample.time_ns = i * 10 * kMillisecond_ns;
    detector.add_imu(sample);
    if (i % 2 == 0) {
      const bool said =
          detector.add_speed({.time_ns = i * 10 * kMillisecond_ns, .speed_mps = speed(t)});
      standing += said && i >= 200;
      total += i >= 200;
    }
  }
  return static_cast<double>(standing) / total;
}

ImuSample resting(double) {
  return {.time_ns = 0, .specific_force_mps2 = {0, 0, 9.81}, .angular_rate_radps = {0, 0, 0}};
}
double zero(double) { return 0.0; }

TEST(StandstillDetector, DetectsStanding) { EXPECT_EQ(standing_share(resting, zero), 1.0); }

TEST(StandstillDetector, BiasDoesNotMatter) {
  const auto biased = [](double t) {
    ImuSample sample = resting(t);
    sample.specific_force_mps2 += Eigen::Vector3d(0.5, -0.8, 1.0);
    sample.angular_rate_radps += Eigen::Vector3d(0.1, -0.2, 0.3);
    return sample;
  };
  EXPECT_EQ(standing_share(biased, zero), 1.0);
}

// Wheel sensors read zero below their dead band; the rest of the car still rocks and turns. The
// swings are fast enough for the span to be exceeded within any half second, also about a peak.
TEST(StandstillDetector, CreepingBelowTheDeadBandIsNotStanding) {
  const auto rocking = [](double t) {
    ImuSample sample = resting(t);
    sample.angular_rate_radps.z() = 0.06 * std::sin(6.0 * t);
    return sample;
  };
  EXPECT_EQ(standing_share(rocking, zero), 0.0);
  const auto jerky = [](double t) {
    ImuSample sample = resting(t);
    sample.specific_force_mps2.x() = 0.5 * std::sin(8.0 * t);
    return sample;
  };
  EXPECT_EQ(standing_share(jerky, zero), 0.0);
}

TEST(StandstillDetector, TurningWheelsAreNotStanding) {
  EXPECT_EQ(standing_share(resting, [](double) { return 0.05; }), 0.0);
  EXPECT_EQ(standing_share(resting, [](double) { return -0.05; }), 0.0);
  EXPECT_EQ(standing_share(resting, [](double) { return std::nan(""); }), 0.0);
}

TEST(StandstillDetector, TakesItsTimeAfterTheWheelsStop) {
  StandstillDetector detector{StandstillModel{}};
  std::int64_t first_ns = -1;
  for (int i = 0; i < 200; ++i) {
    ImuSample sample = resting(0.0);
    sample.time_ns = i * 10 * kMillisecond_ns;
    detector.add_imu(sample);
    const double speed = i < 100 ? 1.0 : 0.0;
    if (detector.add_speed({.time_ns = sample.time_ns, .speed_mps = speed}) && first_ns < 0) {
      first_ns = sample.time_ns;
    }
  }
  EXPECT_EQ(first_ns, 1500 * kMillisecond_ns);
}

TEST(StandstillDetector, SaysNothingWithoutInertialData) {
  StandstillDetector detector{StandstillModel{}};
  for (int i = 0; i < 200; ++i) {
    EXPECT_FALSE(detector.add_speed({.time_ns = i * 10 * kMillisecond_ns, .speed_mps = 0.0}));
  }
}

}  // namespace
}  // namespace topoloc::estimation

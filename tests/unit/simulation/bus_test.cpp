// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/bus.hpp"

#include "topoloc/can/dbc.hpp"
#include "topoloc/simulation/imu.hpp"
#include "topoloc/world/random.hpp"

#include "unit/simulation/toy_road.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include <gtest/gtest.h>

namespace topoloc::simulation {
namespace {

constexpr std::int64_t kBegin_ns = 1'780'000'000'000'000'000;

std::vector<estimation::ImuSample> standing(int count) {
  std::vector<estimation::ImuSample> samples;
  for (int i = 0; i < count; ++i) {
    samples.push_back({.time_ns = i * 10'000'000LL,
                       .specific_force_mps2 = {0.1234, -0.5, 9.81},
                       .angular_rate_radps = {0.001, -0.002, 0.3}});
  }
  return samples;
}

TEST(Bus, CarriesTheShippedDbc) {
  std::ifstream file(std::filesystem::path(TOPOLOC_SOURCE_DIR) / "config/topoloc_imu_wheel.dbc");
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_EQ(dbc_text(), text.str());
}

TEST(Bus, FramesDecodeToTheSamples) {
  const auto imu = standing(2);
  const std::vector<WheelSample> wheels{
      {.time_ns = 5'000'000, .speeds_mps = {-1.25, -1.5, -1.75, -2.0}}};
  const auto frames = put_on_bus(imu, wheels, kBegin_ns, BusSpec::ideal(), 1);
  ASSERT_EQ(frames.size(), 6U);
  const can::Dbc dbc = can::Dbc::parse(dbc_text(), "dbc");
  const auto value = [&](const can::Frame& frame, const char* name) {
    return can::decode(dbc.signal(name).signal->coding, frame.payload()).value();
  };
  EXPECT_EQ(frames[0].id, 0x100U);
  EXPECT_EQ(frames[0].time_ns, kBegin_ns);
  EXPECT_NEAR(value(frames[0], "IMU_ACCEL.ACCEL_X"), 0.1234, 1.01e-4);
  EXPECT_NEAR(value(frames[0], "IMU_ACCEL.ACCEL_Z"), 9.81, 1.01e-4);
  EXPECT_NEAR(value(frames[1], "IMU_RATE.RATE_Y"), -0.002, 1.01e-5);
  EXPECT_EQ(frames[2].id, 0x103U);
  EXPECT_EQ(value(frames[2], "TRAVEL_DIRECTION.DIRECTION"), 2.0);
  EXPECT_EQ(frames[3].id, 0x102U);
  EXPECT_NEAR(value(frames[3], "WHEEL_SPEEDS.REAR_LEFT"), 1.75, 1.01e-3);
  EXPECT_EQ(frames[4].id, 0x100U);
  EXPECT_EQ(value(frames[4], "IMU_ACCEL.ACCEL_COUNTER"), 1.0);
}

// Steps of 2e-5 rad/s would else let the attitude wander, and the position by centimetres with it.
TEST(Bus, SumsOfSamplesStayRightToOneStep) {
  world::Random random(3);
  std::vector<estimation::ImuSample> imu = standing(6000);
  for (estimation::ImuSample& sample : imu) {
    sample.angular_rate_radps.z() += 0.01 * random.normal();
    sample.specific_force_mps2.x() += random.normal();
  }
  const can::Dbc dbc = can::Dbc::parse(dbc_text(), "dbc");
  const can::SignalCoding& accel_x = dbc.signal("IMU_ACCEL.ACCEL_X").signal->coding;
  const can::SignalCoding& rate_z = dbc.signal("IMU_RATE.RATE_Z").signal->coding;
  const auto frames = put_on_bus(imu, {}, kBegin_ns, BusSpec::ideal(), 1);
  ASSERT_EQ(frames.size(), 2 * imu.size());
  double accel_mps2 = 0.0;
  double rate_radps = 0.0;
  for (std::size_t i = 0; i < imu.size(); ++i) {
    accel_mps2 +=
        can::decode(accel_x, frames[2 * i].payload()).value() - imu[i].specific_force_mps2.x();
    rate_radps +=
        can::decode(rate_z, frames[2 * i + 1].payload()).value() - imu[i].angular_rate_radps.z();
    ASSERT_LT(std::abs(accel_mps2), 1.01e-4) << i;
    ASSERT_LT(std::abs(rate_radps), 1.01e-5) << i;
  }
}

TEST(Bus, StampsAreLateByFractionsOfAMillisecondAndInOrder) {
  const auto imu = standing(1000);
  const auto frames = put_on_bus(imu, {}, kBegin_ns, BusSpec{}, 7);
  ASSERT_EQ(frames.size(), 2000U);
  double latest_s = 0.0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double late_s =
        static_cast<double>(frames[i].time_ns - kBegin_ns - imu[i / 2].time_ns) * 1e-9;
    latest_s = std::max(latest_s, late_s);
    EXPECT_GE(late_s, -70e-6);
    EXPECT_LE(late_s, 370e-6);
    EXPECT_EQ(frames[i].id, i % 2 == 0 ? 0x100U : 0x101U);
    EXPECT_TRUE(i == 0 || frames[i - 1].time_ns <= frames[i].time_ns);
  }
  EXPECT_GT(latest_s, 200e-6);
}

TEST(Bus, RefusesAValueThatDoesNotFit) {
  auto imu = standing(1);
  imu[0].specific_force_mps2.x() = 500.0;
  EXPECT_THROW(put_on_bus(imu, {}, kBegin_ns, BusSpec::ideal(), 1), std::runtime_error);
}

TEST(Bus, SameKeySameFrames) {
  const auto toy = testing::town_road();
  const Ego ego = drive_along(toy.road, {}, 5);
  const auto frames = [&](std::uint64_t key) {
    const auto imu = sense_motion(ego.trajectory, RigidTransform{}, ImuSpec{}, key);
    const auto wheels = sense_wheels(ego.trajectory, VehicleModel{}, WheelSpec{}, key);
    return put_on_bus(imu, wheels, kBegin_ns, BusSpec{}, key);
  };
  EXPECT_EQ(frames(4), frames(4));
  EXPECT_NE(frames(4), frames(5));
}

}  // namespace
}  // namespace topoloc::simulation

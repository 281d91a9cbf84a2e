// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
// A real car: wheel speeds from the CAN log of a Toyota against those that its recorder decoded.
#include "topoloc/can/candump.hpp"
#include "topoloc/can/vehicle_signals.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

namespace topoloc::can {
namespace {

std::filesystem::path data_folder() {
  const char* configured = std::getenv("TOPOLOC_DATA");
  return configured != nullptr ? std::filesystem::path(configured)
                               : std::filesystem::path(TOPOLOC_SOURCE_DIR) / "../shared/data";
}

void expect_reference_speeds(const std::string& dbc_name) {
  const auto folder = data_folder() / "comma2k19_example";
  if (!std::filesystem::exists(folder / "can.log")) {
    GTEST_SKIP() << "no comma2k19_example in " << data_folder();
  }
  VehicleSignalsConfig config;
  config.dbcs = {folder / dbc_name};
  config.wheels.speeds = {"WHEEL_SPEEDS.WHEEL_SPEED_FL", "WHEEL_SPEEDS.WHEEL_SPEED_FR",
                          "WHEEL_SPEEDS.WHEEL_SPEED_RL", "WHEEL_SPEEDS.WHEEL_SPEED_RR"};
  config.wheels.interface = "can0";
  VehicleSignals signals(config);

  std::ifstream reference(folder / "wheel_speed.csv");
  std::string line;
  std::getline(reference, line);  // header
  CandumpReader reader(folder / "can.log");
  int compared = 0;
  for (Frame frame; reader.next(frame);) {
    const auto sample = signals.feed(frame).speed;
    if (!sample) {
      continue;
    }
    ASSERT_TRUE(std::getline(reference, line)) << "more samples than the reference";
    std::size_t used = 0;
    ASSERT_EQ(sample->time_ns, std::stoll(line, &used));
    double sum = 0.0;
    for (int wheel = 0; wheel < 4; ++wheel) {
      line.erase(0, used + 1);
      sum += std::stod(line, &used);
    }
    ASSERT_NEAR(sample->speed_mps, sum / 4, 1e-6);
    ++compared;
  }
  EXPECT_FALSE(std::getline(reference, line)) << "fewer samples than the reference";
  EXPECT_GT(compared, 4000);
  EXPECT_EQ(signals.rejected_total(), 0U);
  EXPECT_EQ(reader.malformed_count(), 0U);
}

TEST(Comma2k19, WheelSpeedsEqualTheReference) {
  expect_reference_speeds("toyota_wheel_speeds.dbc");
}

TEST(Comma2k19, OriginalDbcWithOverlappingSignalsGivesTheSame) {
  expect_reference_speeds("_toyota_2017.dbc");
}

}  // namespace
}  // namespace topoloc::can

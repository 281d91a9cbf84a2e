// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/replay/fault_script.hpp"

#include "topoloc/config/config_error.hpp"

#include "support/temporary_folder.hpp"

#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::replay {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class FaultScriptTest : public ::testing::Test {
 protected:
  FaultScriptTest() {
    vehicle_.dbcs = {std::filesystem::path(TOPOLOC_SOURCE_DIR) / "config/topoloc_imu_wheel.dbc"};
    vehicle_.wheels.speeds = {"WHEEL_SPEEDS.FRONT_LEFT"};
  }
  FaultScript load(const std::string& text) {
    return load_fault_script(folder_.with("faults.yaml", text), vehicle_);
  }
  void refused(const std::string& text, const std::string& why) {
    EXPECT_THAT([&] { load(text); }, ThrowsMessage<config::ConfigError>(HasSubstr(why)));
  }

  testing::TemporaryFolder folder_;
  can::VehicleSignalsConfig vehicle_;
};

TEST_F(FaultScriptTest, ReadsEveryKindAndKey) {
  const FaultScript script = load(R"(format: 1
seed: 7
faults:
- {kind: can_dropout, at_s: 1, for_s: 2.5, messages: [IMU_ACCEL, IMU_RATE], share: 0.5}
- {kind: can_burst, at_s: 1, for_s: 2, interface: can0}
- {kind: can_bit_errors, at_s: 1, for_s: 2, share: 0.1, bits: 3}
- {kind: can_frozen, at_s: 1, for_s: 2, signals: [IMU_RATE.RATE_Z]}
- {kind: can_duplicate, at_s: 1, for_s: 2}
- {kind: can_reorder, at_s: 1, for_s: 2, by: 4}
- {kind: wheel_slip, at_s: 1, for_s: 2, factor: 1.2}
- {kind: camera_drop, at_s: 1, for_s: 2}
- {kind: camera_freeze, at_s: 1, for_s: 2}
- {kind: camera_blackout, at_s: 1, for_s: 2}
- {kind: camera_time_step, at_s: 1, for_s: 2, step_s: -0.1}
- {kind: camera_delay, at_s: 1, for_s: 2, delay_s: 0.3}
- {kind: camera_elsewhere, at_s: 1, for_s: 2, offset_s: 20}
)");
  EXPECT_EQ(script.seed, 7U);
  ASSERT_EQ(script.faults.size(), kFaultKindCount);
  for (std::size_t i = 0; i < kFaultKindCount; ++i) {
    EXPECT_EQ(script.faults[i].kind, static_cast<FaultKind>(i));
  }
  const Fault& dropout = script.faults[0];
  EXPECT_TRUE(dropout.active(1'000'000'000));
  EXPECT_FALSE(dropout.active(3'500'000'000));
  EXPECT_EQ(dropout.ids.size(), 2U);
  EXPECT_EQ(dropout.share, 0.5);
  EXPECT_EQ(script.faults[3].signals.front().signal->name, "RATE_Z");
  EXPECT_EQ(script.faults[6].ids.front().id, 0x102U);
  EXPECT_EQ(script.faults[10].offset_ns, -100'000'000);
}

TEST_F(FaultScriptTest, ComplainsWithFileLineAndKey) {
  refused("format: 1\nfaults:\n- {kind: can_drop, at_s: 1, for_s: 1}\n",
          "faults.yaml:3: faults[0].kind: expected one of can_dropout");
  refused("format: 1\nfaults:\n- {kind: camera_drop, at_s: 1, for_s: 1, messages: [X]}\n",
          "faults.yaml:3: faults[0].messages: unknown key");
  refused("format: 1\nfaults:\n- kind: wheel_slip\n  at_s: 1\n  for_s: 1\n",
          "faults[0].factor: missing");
  refused("format: 1\nfaults:\n- kind: can_burst\n  at_s: 1\n  for_s: 0\n",
          "faults.yaml:5: faults[0].for_s: expected a number");
  refused("format: 1\nfaults:\n- {kind: can_burst, at_s: 1, for_s: 1, messages: [NONE]}\n",
          "no DBC file of the vehicle has a message 'NONE'");
  refused("format: 1\nfaults:\n- {kind: can_frozen, at_s: 1, for_s: 1, signals: [IMU_RATE.X]}\n",
          "faults.yaml:3: faults[0].signals: ");
  refused("format: 1\nfault: []\n", "faults.yaml:2: fault: unknown key");
  refused("format: 1\nfaults: {a: 1}\n", "faults.yaml:2: faults: expected a list of maps");
  refused("format: 2\n", "format");
}

}  // namespace
}  // namespace topoloc::replay

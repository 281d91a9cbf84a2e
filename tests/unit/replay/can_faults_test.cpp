// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/replay/can_faults.hpp"

#include "support/temporary_folder.hpp"

#include <algorithm>
#include <bit>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::replay {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::IsEmpty;

constexpr auto kDbc = R"(BO_ 256 SPEED: 8 X
 SG_ LEFT : 0|16@1+ (0.01,0) [0|300] "km/h" X
 SG_ RIGHT : 16|16@1+ (0.01,0) [0|300] "km/h" X
 SG_ COUNT : 60|4@1+ (1,0) [0|15] "" X
 SG_ SUM : 48|8@1+ (1,0) [0|255] "" X
BO_ 257 OTHER: 8 X
 SG_ A : 0|8@1+ (1,0) [0|255] "" X
)";

/// Frames 0, 1, 2, ... of id 256 every 10 ms from zero on, with their number in the first byte.
class CanFaultsTest : public ::testing::Test {
 protected:
  static constexpr std::int64_t kMillisecond_ns = 1'000'000;

  void script(const std::string& faults) {
    const auto dbc = folder_.with("car.dbc", kDbc);
    can::VehicleSignalsConfig vehicle;
    vehicle.dbcs = {dbc};
    vehicle.wheels.speeds = {"SPEED.LEFT", "SPEED.RIGHT"};
    vehicle.checks = checks_;
    script_ =
        load_fault_script(folder_.with("faults.yaml", "format: 1\nfaults:\n" + faults), vehicle);
  }

  static TimedFrame frame(int number, std::uint32_t id = 256) {
    TimedFrame made;
    made.elapsed_ns = number * 10 * kMillisecond_ns;
    made.frame.id = id;
    made.frame.length = 8;
    made.frame.set_interface("can0");
    made.frame.data[0] = static_cast<std::uint8_t>(number);
    return made;
  }
  std::vector<TimedFrame> run(const std::vector<TimedFrame>& frames) {
    CanFaults faults(script_);
    std::vector<TimedFrame> out;
    for (const TimedFrame& next : frames) {
      faults.push(next, out);
    }
    faults.finish(out);
    affected_ = faults.affected();
    return out;
  }
  static std::vector<TimedFrame> series(int count) {
    std::vector<TimedFrame> frames;
    for (int i = 0; i < count; ++i) {
      frames.push_back(frame(i));
    }
    return frames;
  }
  static std::vector<int> numbers(const std::vector<TimedFrame>& frames) {
    std::vector<int> all;
    for (const TimedFrame& timed : frames) {
      all.push_back(timed.frame.data[0]);
    }
    return all;
  }
  static std::vector<std::int64_t> times_ms(const std::vector<TimedFrame>& frames) {
    std::vector<std::int64_t> all;
    for (const TimedFrame& timed : frames) {
      all.push_back(timed.elapsed_ns / kMillisecond_ns);
    }
    return all;
  }

  testing::TemporaryFolder folder_;
  std::vector<can::MessageCheckConfig> checks_;
  FaultScript script_;
  std::vector<std::uint64_t> affected_;
};

TEST_F(CanFaultsTest, WithoutFaultsNothingChanges) {
  EXPECT_THAT(numbers(run(series(4))), ElementsAre(0, 1, 2, 3));
}

TEST_F(CanFaultsTest, DropoutEndsWhereItSaysAndSparesOthers) {
  script("- {kind: can_dropout, at_s: 0.01, for_s: 0.02, messages: [SPEED]}\n");
  auto frames = series(5);
  frames.insert(frames.begin() + 2, frame(1, 257));
  EXPECT_THAT(numbers(run(frames)), ElementsAre(0, 1, 3, 4));
  EXPECT_THAT(affected_, ElementsAre(2));
}

TEST_F(CanFaultsTest, FaultsOfAnInterfaceSpareTheOther) {
  script("- {kind: can_dropout, at_s: 0, for_s: 1, interface: can1}\n");
  EXPECT_THAT(numbers(run(series(3))), ElementsAre(0, 1, 2));
}

TEST_F(CanFaultsTest, BurstComesAllAtOnceAtItsEnd) {
  script("- {kind: can_burst, at_s: 0.01, for_s: 0.025}\n");
  const auto out = run(series(6));
  EXPECT_THAT(numbers(out), ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT(times_ms(out), ElementsAre(0, 35, 35, 35, 40, 50));
}

TEST_F(CanFaultsTest, BurstBeyondTheEndOfTheDriveIsNotLost) {
  script("- {kind: can_burst, at_s: 0.01, for_s: 10}\n");
  EXPECT_THAT(times_ms(run(series(3))), ElementsAre(0, 10010, 10010));
}

TEST_F(CanFaultsTest, BitErrorsFlipAsManyBitsAsAskedForAndComeOutTheSameAgain) {
  script("- {kind: can_bit_errors, at_s: 0, for_s: 1, share: 0.5, bits: 1}\n");
  const auto frames = series(100);
  const auto out = run(frames);
  ASSERT_EQ(out.size(), frames.size());
  int damaged = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    int bits = 0;
    for (std::size_t b = 0; b < 8; ++b) {
      bits += std::popcount(static_cast<unsigned>(out[i].frame.data[b] ^ frames[i].frame.data[b]));
    }
    EXPECT_LE(bits, 1);
    damaged += bits;
  }
  EXPECT_GT(damaged, 30);
  EXPECT_LT(damaged, 70);
  EXPECT_THAT(affected_, ElementsAre(damaged));
  EXPECT_EQ(numbers(run(frames)), numbers(out));
}

TEST_F(CanFaultsTest, FrozenPayloadIsTheLastBefore) {
  script("- {kind: can_frozen, at_s: 0.02, for_s: 0.02}\n");
  const auto out = run(series(6));
  EXPECT_THAT(numbers(out), ElementsAre(0, 1, 1, 1, 4, 5));
  EXPECT_THAT(times_ms(out), ElementsAre(0, 10, 20, 30, 40, 50));
}

TEST_F(CanFaultsTest, FrozenSignalLeavesOthersAlone) {
  script("- {kind: can_frozen, at_s: 0.02, for_s: 0.02, signals: [SPEED.LEFT]}\n");
  auto frames = series(5);
  for (TimedFrame& next : frames) {
    next.frame.data[7] = static_cast<std::uint8_t>(next.frame.data[0] << 4);
  }
  const auto out = run(frames);
  EXPECT_THAT(numbers(out), ElementsAre(0, 1, 1, 1, 4));
  for (std::size_t i = 0; i < out.size(); ++i) {
    EXPECT_EQ(out[i].frame.data[7], frames[i].frame.data[7]);
  }
}

TEST_F(CanFaultsTest, DuplicatesFollowTheirOriginals) {
  script("- {kind: can_duplicate, at_s: 0.01, for_s: 0.01}\n");
  EXPECT_THAT(numbers(run(series(3))), ElementsAre(0, 1, 1, 2));
}

TEST_F(CanFaultsTest, ReorderedFramesAreOvertaken) {
  script("- {kind: can_reorder, at_s: 0.01, for_s: 0.03, by: 1}\n");
  const auto out = run(series(6));
  EXPECT_THAT(numbers(out), ElementsAre(0, 2, 1, 4, 3, 5));
  EXPECT_THAT(times_ms(out), ElementsAre(0, 20, 20, 40, 40, 50));
  script("- {kind: can_reorder, at_s: 0.01, for_s: 0.01, by: 3}\n");
  EXPECT_THAT(numbers(run(series(6))), ElementsAre(0, 2, 3, 4, 1, 5));
  EXPECT_THAT(numbers(run(series(3))), ElementsAre(0, 2, 1)) << "the last is not lost";
}

TEST_F(CanFaultsTest, WheelSlipScalesTheVehiclesSpeedSignals) {
  script("- {kind: wheel_slip, at_s: 0, for_s: 0.01, factor: 1.5}\n");
  TimedFrame slow = frame(0);
  const auto put = [&](std::size_t at, unsigned value) {
    slow.frame.data[at] = static_cast<std::uint8_t>(value & 0xFFU);
    slow.frame.data[at + 1] = static_cast<std::uint8_t>(value >> 8U);
  };
  put(0, 4000);   // 40 km/h
  put(2, 25000);  // 250 km/h: 375 is beyond the limit of 300
  slow.frame.data[7] = 0xF0;
  const auto out = run({slow});
  ASSERT_EQ(out.size(), 1U);
  put(0, 6000);
  put(2, 30000);
  EXPECT_THAT(out[0].frame.data, ElementsAreArray(slow.frame.data));
}

TEST_F(CanFaultsTest, ChangedSignalsKeepARightChecksum) {
  checks_ = {{.message = "SPEED", .checksum = "SUM", .algorithm = can::Checksum::kXor8}};
  script(
      "- {kind: wheel_slip, at_s: 0, for_s: 0.01, factor: 2}\n"
      "- {kind: can_bit_errors, at_s: 0.01, for_s: 0.01}\n");
  auto frames = series(2);
  for (TimedFrame& next : frames) {
    next.frame.data[0] = 50;
    next.frame.data[6] = 50;  // exclusive or of the others
  }
  const auto out = run(frames);
  EXPECT_EQ(out[0].frame.data[0], 100);
  EXPECT_EQ(out[0].frame.data[6], 100);
  can::MessageCheck check = std::move(script_.checks.front());
  EXPECT_EQ(check.check(out[0].frame), can::CheckVerdict::kOk);
  EXPECT_EQ(check.check(out[1].frame), can::CheckVerdict::kWrongChecksum);
}

TEST_F(CanFaultsTest, SeveralFaultsTakeEffectInTheOrderOfTheScript) {
  script(
      "- {kind: can_duplicate, at_s: 0, for_s: 1}\n"
      "- {kind: can_burst, at_s: 0, for_s: 0.02}\n");
  const auto out = run(series(3));
  EXPECT_THAT(numbers(out), ElementsAre(0, 0, 1, 1, 2, 2));
  EXPECT_THAT(times_ms(out), ElementsAre(20, 20, 20, 20, 20, 20));
}

TEST_F(CanFaultsTest, CameraFaultsDoNotTouchIt) {
  script("- {kind: camera_drop, at_s: 0, for_s: 1}\n");
  EXPECT_THAT(numbers(run(series(2))), ElementsAre(0, 1));
  script("- {kind: can_dropout, at_s: 0, for_s: 1}\n");
  EXPECT_THAT(run(series(2)), IsEmpty());
}

}  // namespace
}  // namespace topoloc::replay

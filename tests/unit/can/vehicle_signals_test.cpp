// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/can/vehicle_signals.hpp"

#include "topoloc/can/can_receiver.hpp"

#include "support/allocation_trap.hpp"
#include "support/temporary_folder.hpp"

#include <functional>
#include <numbers>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::can {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr auto kSensorsDbc = R"(BO_ 256 ACCEL: 8 X
 SG_ AX : 0|16@1- (0.01,0) [-100|100] "m/s^2" X
 SG_ AY : 16|16@1- (0.01,0) [-100|100] "m/s^2" X
 SG_ AZ : 32|16@1- (0.01,0) [-100|100] "m/s^2" X
 SG_ COUNT : 48|4@1+ (1,0) [0|15] "" X
BO_ 257 RATE: 8 X
 SG_ WX : 0|16@1- (0.1,0) [0|0] "deg/s" X
 SG_ WY : 16|16@1- (0.1,0) [0|0] "deg/s" X
 SG_ WZ : 32|16@1- (0.1,0) [0|0] "deg/s" X
 SG_ COUNT : 48|4@1+ (1,0) [0|15] "" X
BO_ 512 FRONT: 4 X
 SG_ FL : 0|16@1+ (0.01,0) [0|300] "km/h" X
 SG_ FR : 16|16@1+ (0.01,0) [0|300] "km/h" X
BO_ 513 REAR: 4 X
 SG_ RL : 0|16@1+ (0.01,0) [0|300] "km/h" X
 SG_ RR : 16|16@1+ (0.01,0) [0|300] "km/h" X
BO_ 768 GEARBOX: 1 X
 SG_ GEAR : 0|4@1- (1,0) [0|0] "" X
BO_ 769 MUX: 3 X
 SG_ PAGE M : 0|8@1+ (1,0) [0|0] "" X
 SG_ A m0 : 8|16@1+ (0.1,0) [0|0] "" X
 SG_ B m1 : 8|16@1+ (0.1,0) [0|0] "" X
BO_ 770 FLOATS: 4 X
 SG_ F : 0|32@1- (1,0) [0|0] "m/s" X
BO_ 771 CHECKED: 8 X
 SG_ SPEED : 0|16@1+ (0.01,0) [0|300] "km/h" X
 SG_ COUNT : 16|4@1+ (1,0) [0|15] "" X
 SG_ SUM : 63|8@0+ (1,0) [0|255] "" X
SIG_VALTYPE_ 770 F : 1;
VAL_ 768 GEAR 1 "D" -1 "R" ;
)";

constexpr std::int64_t kMillisecond_ns = 1'000'000;

class VehicleSignalsTest : public ::testing::Test {
 protected:
  VehicleSignalsTest() : dbc_(Dbc::parse(kSensorsDbc, "car.dbc")) {
    config_.dbcs = {folder_.with("car.dbc", kSensorsDbc)};
  }

  void with_imu() {
    config_.imu.acceleration = {"ACCEL.AX", "ACCEL.AY", "ACCEL.AZ"};
    config_.imu.angular_rate = {"RATE.WX", "RATE.WY", "RATE.WZ"};
  }

  void with_imu_counters() {
    with_imu();
    config_.imu.counters = {"ACCEL.COUNT", "RATE.COUNT"};
  }

  /// A frame with signals set by name; time in milliseconds.
  Frame frame(double time_ms, const std::string& message,
              const std::vector<std::pair<std::string, double>>& values) const {
    Frame made;
    made.time_ns = static_cast<std::int64_t>(time_ms * 1e6);
    made.set_interface("can0");
    for (const auto& [signal, value] : values) {
      const SignalRef ref = dbc_.signal(message + "." + signal);
      made.id = ref.message->id;
      made.length = static_cast<std::uint8_t>(ref.message->length_bytes);
      EXPECT_TRUE(encode(ref.signal->coding, value, made.data));
    }
    return made;
  }
  Frame accel(double time_ms, double x, double count = 0) const {
    return frame(time_ms, "ACCEL", {{"AX", x}, {"AY", 0.5}, {"AZ", 9.81}, {"COUNT", count}});
  }
  Frame rate(double time_ms, double z, double count = 0) const {
    return frame(time_ms, "RATE", {{"WX", 0}, {"WY", -1}, {"WZ", z}, {"COUNT", count}});
  }
  Frame wheels(double time_ms, const std::string& axle, double kmh) const {
    const std::string prefix = axle.substr(0, 1);
    return frame(time_ms, axle, {{prefix + "L", kmh - 1}, {prefix + "R", kmh + 1}});
  }

  testing::TemporaryFolder folder_;
  Dbc dbc_;
  VehicleSignalsConfig config_;
};

TEST_F(VehicleSignalsTest, PairsAccelerationAndRateByTimeInEitherOrder) {
  with_imu();
  VehicleSignals signals(config_);
  EXPECT_FALSE(signals.feed(accel(10.0, 1.0)).imu);
  const auto first = signals.feed(rate(10.4, 18.0)).imu;
  ASSERT_TRUE(first);
  EXPECT_EQ(first->time_ns, 10'400'000) << "the rates give the time";
  EXPECT_NEAR(first->specific_force_mps2.x(), 1.0, 1e-12);
  EXPECT_NEAR(first->specific_force_mps2.z(), 9.81, 1e-12);
  EXPECT_NEAR(first->angular_rate_radps.z(), std::numbers::pi / 10, 1e-12);
  EXPECT_NEAR(first->angular_rate_radps.y(), -std::numbers::pi / 180, 1e-12);

  EXPECT_FALSE(signals.feed(rate(20.0, 36.0)).imu);
  const auto second = signals.feed(accel(20.3, 2.0)).imu;
  ASSERT_TRUE(second);
  EXPECT_EQ(second->time_ns, 20'000'000);
  EXPECT_NEAR(second->specific_force_mps2.x(), 2.0, 1e-12);
  EXPECT_NEAR(second->angular_rate_radps.z(), std::numbers::pi / 5, 1e-12);
  EXPECT_EQ(signals.rejected_total(), 0U);
}

TEST_F(VehicleSignalsTest, LostFrameCostsItsSampleOnly) {
  with_imu();
  VehicleSignals signals(config_);
  signals.feed(accel(10.0, 1.0));  // its partner is lost
  EXPECT_FALSE(signals.feed(rate(20.0, 2.0)).imu) << "10 ms apart: not one sample";
  const auto sample = signals.feed(accel(20.1, 3.0)).imu;
  ASSERT_TRUE(sample);
  EXPECT_NEAR(sample->specific_force_mps2.x(), 3.0, 1e-12);
  EXPECT_EQ(signals.rejected(SignalReject::kUnpaired), 1U);
}

TEST_F(VehicleSignalsTest, CountersPairWhatTimeCannot) {
  with_imu_counters();
  VehicleSignals signals(config_);
  signals.feed(accel(10.0, 1.0, 7));
  EXPECT_TRUE(signals.feed(rate(16.0, 1.0, 7)).imu) << "bunched by the gateway, counter agrees";
  signals.feed(accel(20.0, 1.0, 8));
  EXPECT_FALSE(signals.feed(rate(20.1, 1.0, 9)).imu) << "close in time, counter differs";
  EXPECT_EQ(signals.rejected(SignalReject::kUnpaired), 1U);
  EXPECT_TRUE(signals.feed(accel(20.2, 1.0, 9)).imu);
  signals.feed(accel(30.0, 1.0, 10));
  EXPECT_FALSE(signals.feed(rate(190.0, 1.0, 10)).imu) << "the counter has come round";
}

TEST_F(VehicleSignalsTest, AccelerationFrameCanGiveTheTime) {
  with_imu();
  config_.imu.time_source = ImuTimeSource::kAcceleration;
  VehicleSignals signals(config_);
  signals.feed(accel(10.0, 1.0));
  EXPECT_EQ(signals.feed(rate(10.4, 1.0)).imu->time_ns, 10 * kMillisecond_ns);
}

TEST_F(VehicleSignalsTest, SpeedIsTheMeanOfAllWheelsOverTwoFrames) {
  config_.wheels.speeds = {"FRONT.FL", "FRONT.FR", "REAR.RL", "REAR.RR"};
  VehicleSignals signals(config_);
  EXPECT_FALSE(signals.feed(wheels(10, "FRONT", 36.0)).speed);
  const auto sample = signals.feed(wheels(12, "REAR", 72.0)).speed;
  ASSERT_TRUE(sample);
  EXPECT_NEAR(sample->speed_mps, 15.0, 1e-12);
  EXPECT_EQ(sample->time_ns, 12 * kMillisecond_ns);
  EXPECT_FALSE(signals.feed(wheels(30, "REAR", 72.0)).speed);
  EXPECT_FALSE(signals.feed(wheels(50, "FRONT", 72.0)).speed) << "20 ms apart";
  EXPECT_EQ(signals.rejected(SignalReject::kUnpaired), 1U);
}

TEST_F(VehicleSignalsTest, ReverseGearMakesSpeedNegative) {
  config_.wheels.speeds = {"REAR.RL", "REAR.RR"};
  for (const char* reverse : {"R", "-1"}) {
    config_.direction.signal = "GEARBOX.GEAR";
    config_.direction.reverse_values = {"5", reverse};
    VehicleSignals signals(config_);
    EXPECT_NEAR(signals.feed(wheels(10, "REAR", 36.0)).speed->speed_mps, 10.0, 1e-12);
    signals.feed(frame(15, "GEARBOX", {{"GEAR", -1}}));
    EXPECT_NEAR(signals.feed(wheels(20, "REAR", 36.0)).speed->speed_mps, -10.0, 1e-12);
    signals.feed(frame(25, "GEARBOX", {{"GEAR", 1}}));
    EXPECT_NEAR(signals.feed(wheels(30, "REAR", 36.0)).speed->speed_mps, 10.0, 1e-12);
  }
}

TEST_F(VehicleSignalsTest, TakesFramesOfItsInterfaceOnly) {
  config_.wheels.speeds = {"REAR.RL", "REAR.RR"};
  config_.wheels.interface = "can0";
  VehicleSignals signals(config_);
  Frame other = wheels(10, "REAR", 36.0);
  other.set_interface("can128");
  EXPECT_FALSE(signals.feed(other).speed);
  Frame extended = wheels(10, "REAR", 36.0);
  extended.extended = true;
  EXPECT_FALSE(signals.feed(extended).speed) << "same number, another id";
  EXPECT_EQ(signals.rejected_total(), 0U);
  EXPECT_TRUE(signals.feed(wheels(10, "REAR", 36.0)).speed);
}

TEST_F(VehicleSignalsTest, SensorsOfDifferentFilesMayShareIdsOnDifferentInterfaces) {
  // The IMU box uses id 513 as well, and a message of the same name.
  config_.dbcs.push_back(folder_.with("imu.dbc", R"(BO_ 513 REAR: 8 X
 SG_ AX : 0|8@1- (1,0) [0|0] "m/s^2" X
 SG_ AY : 8|8@1- (1,0) [0|0] "m/s^2" X
 SG_ AZ : 16|8@1- (1,0) [0|0] "m/s^2" X
 SG_ WX : 24|8@1- (0.01,0) [0|0] "rad/s" X
 SG_ WY : 32|8@1- (0.01,0) [0|0] "rad/s" X
 SG_ WZ : 40|8@1- (0.01,0) [0|0] "rad/s" X
)"));
  config_.imu.acceleration = {"REAR.AX", "REAR.AY", "REAR.AZ"};
  config_.imu.angular_rate = {"REAR.WX", "REAR.WY", "REAR.WZ"};
  config_.imu.interface = "imu0";
  config_.wheels.speeds = {"REAR.RL", "REAR.RR"};
  config_.wheels.interface = "can0";
  VehicleSignals signals(config_);
  const Frame wheels = frame(0, "REAR", {{"RL", 36.0}, {"RR", 36.0}});
  Frame imu = wheels;
  imu.set_interface("imu0");
  imu.length = 8;
  imu.data = {1, 2, 10, 1, 2, 3};
  const auto of_wheels = signals.feed(wheels);
  const auto of_imu = signals.feed(imu);
  ASSERT_TRUE(of_wheels.speed && of_imu.imu);
  EXPECT_FALSE(of_wheels.imu || of_imu.speed);
  EXPECT_NEAR(of_wheels.speed->speed_mps, 10.0, 1e-9);
  EXPECT_NEAR(of_imu.imu->specific_force_mps2.z(), 10.0, 1e-9);
  EXPECT_NEAR(of_imu.imu->angular_rate_radps.z(), 0.03, 1e-9);

  config_.wheels.interface.clear();
  EXPECT_THAT([this] { VehicleSignals{config_}; },
              ThrowsMessage<std::runtime_error>(HasSubstr("both have id 513")));
}

TEST_F(VehicleSignalsTest, SignalOfTwoFilesIsAmbiguous) {
  config_.wheels.speeds = {"REAR.RL"};
  config_.dbcs.push_back(folder_.with("copy.dbc", kSensorsDbc));
  EXPECT_THAT([this] { VehicleSignals{config_}; },
              ThrowsMessage<std::runtime_error>(HasSubstr("'REAR.RL' is in 2 of these files")));
}

TEST_F(VehicleSignalsTest, CountsEveryRejectUnderItsReason) {
  config_.wheels.speeds = {"REAR.RL", "REAR.RR"};
  VehicleSignals signals(config_);
  Frame remote = wheels(10, "REAR", 36.0);
  remote.kind = FrameKind::kRemote;
  EXPECT_FALSE(signals.feed(remote).speed);
  EXPECT_EQ(signals.rejected(SignalReject::kNotDataFrame), 1U);

  Frame short_one = wheels(10, "REAR", 36.0);
  short_one.length = 3;
  EXPECT_FALSE(signals.feed(short_one).speed);
  EXPECT_EQ(signals.rejected(SignalReject::kTooShort), 1U);

  EXPECT_FALSE(signals.feed(wheels(10, "REAR", 299.5)).speed) << "one wheel at 300.5 km/h";
  EXPECT_EQ(signals.rejected(SignalReject::kOutOfLimits), 1U);

  EXPECT_TRUE(signals.feed(wheels(10, "REAR", 36.0)).speed);
  EXPECT_FALSE(signals.feed(wheels(10, "REAR", 36.0)).speed);
  EXPECT_FALSE(signals.feed(wheels(9, "REAR", 36.0)).speed);
  EXPECT_EQ(signals.rejected(SignalReject::kNonMonotonicTime), 2U);
  EXPECT_EQ(signals.rejected_total(), 5U);

  config_.check_limits = false;
  VehicleSignals unchecked(config_);
  EXPECT_TRUE(unchecked.feed(wheels(10, "REAR", 299.5)).speed);
}

TEST_F(VehicleSignalsTest, OneStampFarInTheFutureCostsOneSample) {
  with_imu();
  VehicleSignals signals(config_);
  int samples = 0;
  for (int i = 0; i < 1000; ++i) {
    const double time_ms = 10.0 * i;
    samples += signals.feed(accel(time_ms, 1.0)).imu ? 1 : 0;
    samples += signals.feed(rate(i == 500 ? time_ms + 3.6e6 : time_ms, 1.0)).imu ? 1 : 0;
  }
  EXPECT_EQ(samples, 999);
  EXPECT_EQ(signals.rejected(SignalReject::kLeapInTime), 1U);
  EXPECT_EQ(signals.rejected(SignalReject::kUnpaired), 1U);
  EXPECT_EQ(signals.rejected_total(), 2U);
  EXPECT_EQ(signals.new_time_lines(), 0U);
}

/// Feeds 20 samples, sets the clock by so much and feeds 20 more; returns the times of all samples.
std::vector<std::int64_t> times_around_set_clock(
    VehicleSignals& signals, double set_by_ms,
    const std::function<VehicleSamples(VehicleSignals&, double)>& feed) {
  std::vector<std::int64_t> times;
  for (int i = 0; i < 40; ++i) {
    const VehicleSamples samples = feed(signals, 100'000.0 + 10.0 * i + (i < 20 ? 0 : set_by_ms));
    if (samples.imu) {
      times.push_back(samples.imu->time_ns);
    } else if (samples.speed) {
      times.push_back(samples.speed->time_ns);
    }
  }
  return times;
}

TEST_F(VehicleSignalsTest, ClockThatWasSetIsBelievedAfterFiveSamples) {
  with_imu();
  config_.wheels.speeds = {"REAR.RL", "REAR.RR"};
  const auto feed_imu = [this](VehicleSignals& signals, double time_ms) {
    signals.feed(accel(time_ms, 1.0));
    return signals.feed(rate(time_ms, 1.0));
  };
  const auto feed_speed = [this](VehicleSignals& signals, double time_ms) {
    return signals.feed(wheels(time_ms, "REAR", 36.0));
  };
  for (const double set_by_ms : {60'000.0, -60'000.0, -205.0}) {
    const auto reason = set_by_ms > 0 ? SignalReject::kLeapInTime : SignalReject::kNonMonotonicTime;
    const std::int64_t last_ns =
        static_cast<std::int64_t>(100'390 + set_by_ms) * kMillisecond_ns;  // of all that are fed
    {
      VehicleSignals signals(config_);
      const auto times = times_around_set_clock(signals, set_by_ms, feed_speed);
      EXPECT_EQ(times.size(), 36U) << "the fifth is believed";
      EXPECT_EQ(times.back(), last_ns);
      EXPECT_EQ(signals.rejected(reason), 4U);
      EXPECT_EQ(signals.rejected_total(), 4U);
      EXPECT_EQ(signals.new_time_lines(), 1U);
    }
    VehicleSignals signals(config_);
    const auto times = times_around_set_clock(signals, set_by_ms, feed_imu);
    EXPECT_EQ(times.size(), 35U) << "the tenth frame is believed, its partner was not";
    EXPECT_EQ(times.back(), last_ns);
    EXPECT_EQ(signals.rejected(reason), 9U);
    EXPECT_EQ(signals.new_time_lines(), 1U);
  }
}

TEST_F(VehicleSignalsTest, FirstStampMayBeTheWrongOne) {
  config_.wheels.speeds = {"REAR.RL", "REAR.RR"};
  for (const double first_ms : {0.0, 1e9}) {
    VehicleSignals signals(config_);
    signals.feed(wheels(first_ms, "REAR", 36.0));
    int samples = 0;
    for (int i = 0; i < 10; ++i) {
      samples += signals.feed(wheels(100'000.0 + 10.0 * i, "REAR", 36.0)).speed ? 1 : 0;
    }
    EXPECT_EQ(samples, 6);
  }
}

TEST_F(VehicleSignalsTest, LateFramesOfOneGatewayMakeNoNewTimeLine) {
  config_.wheels.speeds = {"REAR.RL", "REAR.RR"};
  VehicleSignals signals(config_);
  for (int i = 0; i < 100; ++i) {  // every second frame is 15 ms late
    signals.feed(wheels(10.0 * i - (i % 2 == 0 ? 0.0 : 15.0), "REAR", 36.0));
  }
  EXPECT_EQ(signals.rejected(SignalReject::kNonMonotonicTime), 50U);
  EXPECT_EQ(signals.new_time_lines(), 0U);
}

TEST_F(VehicleSignalsTest, RejectsFloatThatIsNotFinite) {
  config_.wheels.speeds = {"FLOATS.F"};
  VehicleSignals signals(config_);
  Frame nan = frame(10, "FLOATS", {{"F", 1.0}});
  nan.data[2] = 0xC0;
  nan.data[3] = 0x7F;
  EXPECT_FALSE(signals.feed(nan).speed);
  EXPECT_EQ(signals.rejected(SignalReject::kNotFinite), 1U);
  EXPECT_TRUE(signals.feed(frame(20, "FLOATS", {{"F", 1.0}})).speed);
}

TEST_F(VehicleSignalsTest, EveryFrameIsUsedRejectedWaitingOrOfAnotherId) {
  with_imu();
  config_.wheels.speeds = {"REAR.RL", "REAR.RR"};
  VehicleSignals signals(config_);
  Frame other = rate(10.0, 1.0);
  other.id = 0x7FF;
  const std::vector<Frame> frames = {
      accel(10.0, 1.0), rate(10.0, 1.0), wheels(10.0, "REAR", 36.0),  other,  //
      accel(10.0, 1.0), rate(10.0, 1.0),                                      // the same again
      accel(20.0, 1.0),                                                       // partner lost
      accel(30.0, 1.0), rate(30.0, 1.0), wheels(30.0, "REAR", 299.5),         // out of limits
      rate(40.0, 1.0)};                                                       // still waits
  for (const Frame& frame : frames) {
    signals.feed(frame);
  }
  const SignalCounts counts = signals.counts();
  EXPECT_EQ(counts.imu_samples, 2U);
  EXPECT_EQ(counts.speed_samples, 1U);
  EXPECT_EQ(counts.used, 5U);
  EXPECT_EQ(counts.waiting, 1U);
  EXPECT_EQ(counts.other_frames, 1U);
  EXPECT_EQ(signals.rejected(SignalReject::kNonMonotonicTime), 2U) << "both frames of the sample";
  EXPECT_EQ(counts.other_frames + counts.used + counts.waiting + signals.rejected_total(),
            frames.size());
}

TEST_F(VehicleSignalsTest, MultiplexedWheelsComeInTheirOwnFrames) {
  config_.wheels.speeds = {"MUX.A", "MUX.B"};
  config_.wheels.unit = "m/s";
  VehicleSignals signals(config_);
  EXPECT_FALSE(signals.feed(frame(10, "MUX", {{"PAGE", 0}, {"A", 10.0}})).speed);
  EXPECT_FALSE(signals.feed(frame(11, "MUX", {{"PAGE", 2}})).speed);
  const auto sample = signals.feed(frame(12, "MUX", {{"PAGE", 1}, {"B", 20.0}})).speed;
  ASSERT_TRUE(sample);
  EXPECT_NEAR(sample->speed_mps, 15.0, 1e-12);
  EXPECT_EQ(signals.rejected(SignalReject::kMultiplexMismatch), 1U);
  EXPECT_EQ(signals.rejected_total(), 1U);
}

TEST_F(VehicleSignalsTest, FeedingNeverAllocates) {
  with_imu_counters();
  config_.wheels.speeds = {"FRONT.FL", "FRONT.FR", "REAR.RL", "REAR.RR"};
  config_.direction.signal = "GEARBOX.GEAR";
  config_.direction.reverse_values = {"R"};
  VehicleSignals signals(config_);
  std::vector<Frame> frames;
  for (int i = 0; i < 100; ++i) {
    frames.push_back(accel(10 * i, 1.0, i % 16));
    frames.push_back(rate(10 * i, 1.0, (i + i / 50 * 8) % 16));
    frames.push_back(wheels(10 * i, "FRONT", i % 10 == 0 ? 400.0 : 36.0));
    frames.push_back(wheels(10 * i, "REAR", 36.0));
    frames.push_back(frame(10 * i, "GEARBOX", {{"GEAR", i % 2}}));
    frames.back().length = static_cast<std::uint8_t>(i % 2);
  }
  frames.insert(frames.begin() + 250, wheels(1e9, "REAR", 36.0));
  int imu = 0;
  int speed = 0;
  const testing::AllocationTrap trap;
  for (const Frame& f : frames) {
    const VehicleSamples samples = signals.feed(f);
    imu += samples.imu ? 1 : 0;
    speed += samples.speed ? 1 : 0;
  }
  EXPECT_EQ(trap.count(), 0U);
  EXPECT_EQ(imu, 50);
  EXPECT_EQ(speed, 90);
  EXPECT_GT(signals.rejected(SignalReject::kUnpaired), 0U);
  const SignalCounts counts = signals.counts();
  EXPECT_EQ(counts.used + counts.waiting + signals.rejected_total(), frames.size());
}

TEST(AllocationTrap, SeesAllocations) {
  if (!testing::AllocationTrap::kAvailable) {
    GTEST_SKIP() << "this build has a malloc of its own";
  }
  const testing::AllocationTrap trap;
  const std::vector<double> values(1000, 1.0);
  EXPECT_EQ(trap.count(), 1U);
  EXPECT_EQ(values.size(), 1000U);
}

TEST_F(VehicleSignalsTest, BadConfigurationsSayWhatIsWrong) {
  const auto car = config_.dbcs.front();
  const auto expect_error = [&](const std::string& what) {
    EXPECT_THAT([this] { VehicleSignals{config_}; },
                ThrowsMessage<std::runtime_error>(HasSubstr(what)));
    VehicleSignalsConfig fresh;
    fresh.dbcs = {car};
    config_ = fresh;
  };
  expect_error("neither IMU nor wheel speed");
  config_.wheels.speeds = {"REAR.LR"};
  expect_error("no signal 'LR'; close names: RR, RL");
  config_.wheels.speeds = {"MUX.A"};
  expect_error("signal 'MUX.A': unit '' is not one of m/s, km/h");
  config_.wheels.speeds = {"REAR.RL"};
  config_.wheels.unit = "furlong/h";
  expect_error("unit 'furlong/h'");
  config_.wheels.speeds = {"REAR.RL", "REAR.RL", "REAR.RL", "REAR.RL", "REAR.RL"};
  expect_error("at most 4 wheel speeds");
  with_imu();
  config_.imu.angular_rate[1].clear();
  expect_error("three acceleration and three angular rate");
  with_imu_counters();
  config_.imu.counters.pop_back();
  expect_error("counters leave out");
  with_imu_counters();
  config_.imu.counters[1] = "RATE.WX";
  expect_error("not as long");
  config_.wheels.speeds = {"REAR.RL"};
  config_.direction.signal = "GEARBOX.GEAR";
  expect_error("no value is configured to mean reverse");
  config_.wheels.speeds = {"REAR.RL"};
  config_.direction.signal = "GEARBOX.GEAR";
  config_.direction.reverse_values = {"Rear"};
  expect_error("neither a whole number nor one of its value names (D, R)");
  for (const char* too_large : {"16", "-9", "9223372036854775807", "-9223372036854775808"}) {
    config_.wheels.speeds = {"REAR.RL"};
    config_.direction.signal = "GEARBOX.GEAR";
    config_.direction.reverse_values = {"-8", "15", too_large};
    config_.direction.reverse_values_place = "vehicle.yaml:9: can.direction.reverse_values";
    expect_error("vehicle.yaml:9: can.direction.reverse_values: reverse value '" +
                 std::string(too_large) + "' of signal 'GEARBOX.GEAR' does not fit its 4 bits");
  }
  config_.wheels.speeds = {"REAR.RL"};
  config_.direction.signal = "MUX.PAGE";
  config_.direction.reverse_values = {"-1"};
  expect_error("reverse value '-1' of signal 'MUX.PAGE' does not fit its 8 bits");
  config_.dbcs = {"/nowhere/car.dbc"};
  expect_error("/nowhere/car.dbc: cannot open");
  config_.dbcs = {};
  expect_error("no DBC file");
}

TEST_F(VehicleSignalsTest, ListsTheMessagesThatABusFilterMustLetThrough) {
  with_imu_counters();
  config_.imu.interface = "imu0";
  config_.wheels.speeds = {"FRONT.FL", "FRONT.FR", "REAR.RL"};
  const VehicleSignals signals(config_);
  EXPECT_THAT(
      signals.used_messages(),
      ::testing::ElementsAre(UsedMessage{"", {512, false}}, UsedMessage{"", {513, false}},
                             UsedMessage{"imu0", {256, false}}, UsedMessage{"imu0", {257, false}}));
}

TEST_F(VehicleSignalsTest, AsksEveryInterfaceForItsIdsOnly) {
  with_imu();
  config_.imu.interface = "imu0";
  config_.wheels.speeds = {"FRONT.FL"};
  const VehicleSignals signals(config_);
  const auto inputs = can_inputs(signals, {"can0", "imu0=vcan1"});
  ASSERT_EQ(inputs.size(), 2U);
  EXPECT_EQ(inputs[0].device, "can0");
  EXPECT_THAT(inputs[0].ids, ::testing::ElementsAre(FrameId{512, false}));
  EXPECT_EQ(inputs[1].device, "vcan1");
  EXPECT_EQ(inputs[1].interface, "imu0");
  EXPECT_THAT(inputs[1].ids, ::testing::ElementsAre(FrameId{512, false}, FrameId{256, false},
                                                    FrameId{257, false}));
}

TEST_F(VehicleSignalsTest, LeavesOutInterfacesThatCarryNothing) {
  with_imu();
  config_.imu.interface = "can0";
  const VehicleSignals signals(config_);
  EXPECT_EQ(can_inputs(signals, {"can0", "can1"}).size(), 1U);
}

TEST_F(VehicleSignalsTest, RefusesDevicesThatDoNotFitTheSignals) {
  with_imu();
  config_.imu.interface = "imu0";
  const VehicleSignals signals(config_);
  const auto refused = [&](const std::vector<std::string>& devices, const std::string& why) {
    EXPECT_THAT([&] { can_inputs(signals, devices); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(why)));
  };
  refused({}, "no CAN interface is given");
  refused({"can0"}, "signals come on CAN interface 'imu0'");
  refused({"imu0", "imu0"}, "given twice");
  refused({"imu0=can0", "can1=can0"}, "given twice");
  refused({"imu0="}, "expected NAME or NAME=DEVICE");
}

TEST_F(VehicleSignalsTest, ChecksCountersWhereConfigured) {
  config_.wheels.speeds = {"CHECKED.SPEED"};
  config_.checks = {{.message = "CHECKED", .counter = "COUNT"}};
  VehicleSignals signals(config_);
  const auto fed = [&](double time_ms, double count) {
    return signals.feed(frame(time_ms, "CHECKED", {{"SPEED", 10.0}, {"COUNT", count}}))
        .speed.has_value();
  };
  EXPECT_TRUE(fed(0, 14));
  EXPECT_TRUE(fed(10, 15));
  EXPECT_TRUE(fed(20, 0));
  EXPECT_FALSE(fed(30, 0)) << "frozen";
  EXPECT_FALSE(fed(40, 0));
  EXPECT_TRUE(fed(50, 3)) << "2 lost";
  EXPECT_EQ(signals.rejected(SignalReject::kCounterFrozen), 2U);
  EXPECT_EQ(signals.rejected_total(), 2U);
  EXPECT_EQ(signals.lost_messages(), 2U);
}

TEST_F(VehicleSignalsTest, ChecksChecksumsWhereConfigured) {
  config_.wheels.speeds = {"CHECKED.SPEED"};
  config_.checks = {{.message = "CHECKED",
                     .counter = "COUNT",
                     .counter_max = 14,
                     .checksum = "SUM",
                     .algorithm = Checksum::kE2eProfile1,
                     .data_id = 0x123}};
  VehicleSignals signals(config_);
  const MessageCheck check(config_.checks.front(), *dbc_.find(771, false));
  Frame sound = frame(0, "CHECKED", {{"SPEED", 10.0}, {"COUNT", 14}});
  check.seal(sound);
  EXPECT_TRUE(signals.feed(sound).speed.has_value());
  Frame broken = frame(10, "CHECKED", {{"SPEED", 20.0}, {"COUNT", 0}});
  check.seal(broken);
  broken.data[0] ^= 1;
  EXPECT_FALSE(signals.feed(broken).speed.has_value());
  EXPECT_EQ(signals.rejected(SignalReject::kWrongChecksum), 1U);
  Frame beyond = frame(20, "CHECKED", {{"SPEED", 20.0}, {"COUNT", 15}});
  check.seal(beyond);
  EXPECT_FALSE(signals.feed(beyond).speed.has_value());
  EXPECT_EQ(signals.rejected(SignalReject::kCounterOutOfRange), 1U);
  Frame short_one = sound;
  short_one.length = 3;
  EXPECT_FALSE(signals.feed(short_one).speed.has_value());
  EXPECT_EQ(signals.rejected(SignalReject::kTooShort), 1U);
  EXPECT_EQ(signals.lost_messages(), 0U) << "what fails the check says nothing";
}

TEST_F(VehicleSignalsTest, RefusesChecksThatCannotBe) {
  config_.wheels.speeds = {"CHECKED.SPEED"};
  const auto refused = [&](MessageCheckConfig check, const std::string& why) {
    check.place = "vehicle.yaml:5: can.checks[0].message";
    config_.checks = {check};
    EXPECT_THAT([&] { VehicleSignals signals(config_); },
                ThrowsMessage<std::runtime_error>(
                    ::testing::AllOf(HasSubstr("vehicle.yaml:5: can.checks[0]"), HasSubstr(why))));
  };
  refused({.message = "NONE", .counter = "COUNT"}, "is in no DBC file");
  refused({.message = "REAR", .counter = "RL"}, "has none of the configured signals");
  refused({.message = "CHECKED", .counter = "C"}, "has no signal 'C'");
  refused({.message = "CHECKED", .counter = "COUNT", .counter_max = 16}, "cannot count to 16");
  refused({.message = "CHECKED", .checksum = "COUNT"}, "is not one whole byte");
  refused({.message = "CHECKED", .checksum = "SUM", .algorithm = Checksum::kE2eProfile1},
          "needs a data_id");
  refused({.message = "CHECKED"}, "neither counter nor checksum");
}

}  // namespace
}  // namespace topoloc::can

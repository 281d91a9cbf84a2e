// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/last_pose.hpp"

#include "live/stop_event.hpp"
#include "support/temporary_folder.hpp"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace topoloc::live {
namespace {

using namespace std::chrono_literals;

LastPose last_pose_at(double x_m) {
  return {1'000'000'000, {Eigen::Matrix3d::Identity(), {x_m, 0.0, 0.0}}};
}

constexpr std::int64_t kNow_ns = 1'700'000'000'000'000'000;

TickOutput output_of(estimation::Mode mode, double speed_mps, std::uint32_t reasons) {
  TickOutput output;
  output.now_ns = kNow_ns;
  output.estimate.mode = mode;
  output.estimate.reasons = reasons;
  output.estimate.state.v_world_imu = {0.0, speed_mps, 0.0};
  return output;
}

LastPoseVerdict judge(estimation::Mode mode, double speed_mps, std::uint32_t reasons) {
  return judge_last_pose(output_of(mode, speed_mps, reasons));
}

TEST(JudgeLastPose, KeepsThatOfAVehicleThatTracksAndStands) {
  EXPECT_EQ(judge(estimation::Mode::kTracking, 0.1, 0), LastPoseVerdict::kKeep);
}

TEST(JudgeLastPose, RemovesItWhenTheVehicleMoves) {
  using estimation::Mode;
  namespace reason = estimation::reason;
  for (const Mode mode : {Mode::kTracking, Mode::kDeadReckoning, Mode::kLost}) {
    for (const std::uint32_t reasons : {0U, reason::kNoSpeed, reason::kNoMapFix}) {
      EXPECT_EQ(judge(mode, 0.5, reasons), LastPoseVerdict::kRemove);
    }
  }
}

TEST(JudgeLastPose, LeavesItWhenSensorsAreSwitchedOffAndNothingMoves) {
  using estimation::Mode;
  namespace reason = estimation::reason;
  EXPECT_EQ(judge(Mode::kDeadReckoning, 0.0, reason::kNoMapFix), LastPoseVerdict::kLeave);
  // Predicted from the last sample, with its bias and noise: no movement that was measured.
  EXPECT_EQ(judge(Mode::kDeadReckoning, 2.0, reason::kNoImu), LastPoseVerdict::kLeave);
  EXPECT_EQ(judge(Mode::kLost, 9.0, reason::kNoImu | reason::kUncertain), LastPoseVerdict::kLeave);
  EXPECT_EQ(judge(Mode::kUninitialised, 0.0, reason::kNoPose), LastPoseVerdict::kLeave);
}

TEST(JudgeLastPose, LeavesItWhileInertialDataAloneSayThatItMoves) {
  using estimation::Mode;
  constexpr std::uint32_t kReasons = estimation::reason::kNoSpeed | estimation::reason::kNoMapFix;
  EXPECT_EQ(judge(Mode::kDeadReckoning, 0.5, kReasons), LastPoseVerdict::kLeave);
  EXPECT_EQ(judge(Mode::kLost, 5.0, kReasons | estimation::reason::kUncertain),
            LastPoseVerdict::kLeave);
}

// It stopped at a light, its inertial sensor failed, and it went on.
TEST(JudgeLastPose, RemovesItWhenTheFilterDoesNotKnowButTheWheelsTurn) {
  using estimation::Mode;
  namespace reason = estimation::reason;
  for (const std::uint32_t reasons : {reason::kNoImu, reason::kNoSpeed | reason::kNoMapFix}) {
    TickOutput output = output_of(Mode::kDeadReckoning, 0.0, reasons);
    output.speed = {.time_ns = kNow_ns - 100'000'000, .speed_mps = -4.0};
    EXPECT_EQ(judge_last_pose(output), LastPoseVerdict::kRemove);
    output.estimate.mode = Mode::kUninitialised;
    EXPECT_EQ(judge_last_pose(output), LastPoseVerdict::kRemove);
    output.speed.speed_mps = 0.1;
    EXPECT_EQ(judge_last_pose(output), LastPoseVerdict::kLeave);
    output.speed = {.time_ns = kNow_ns - 5'000'000'000, .speed_mps = 4.0};  // of before
    EXPECT_EQ(judge_last_pose(output), LastPoseVerdict::kLeave);
  }
}

TEST(TickRunnerOutput, HasTheNewestSpeedAlthoughTheFilterDoesNotTakeIt) {
  TickRunner runner(estimation::EstimatorConfig{});
  TickInput input;
  input.now_ns = kNow_ns;
  input.speed_count = 2;
  input.speed[0] = {.time_ns = kNow_ns - 2, .speed_mps = 1.0};
  input.speed[1] = {.time_ns = kNow_ns - 1, .speed_mps = 4.0};
  runner.run(input, nullptr);
  input.speed_count = 0;
  const TickOutput& output = runner.run(input, nullptr);
  EXPECT_EQ(output.speed.time_ns, kNow_ns - 1);
  EXPECT_EQ(output.speed.speed_mps, 4.0);
}

class LastPoseKeeperTest : public ::testing::Test {
 protected:
  void run_to_the_end(LastPoseKeeper& keeper) {
    stop_.set();
    keeper.run(stop_);
  }

  testing::TemporaryFolder folder_;
  std::filesystem::path file_ = folder_ / "last.tum";
  StopEvent stop_;
};

TEST_F(LastPoseKeeperTest, WritesTheNewestPoseBeforeItEnds) {
  LastPoseKeeper keeper(file_);
  keeper.keep(last_pose_at(1.0));
  keeper.keep(last_pose_at(2.0));
  run_to_the_end(keeper);
  const auto kept = read_last_pose(file_);
  ASSERT_TRUE(kept);
  EXPECT_DOUBLE_EQ(kept->T_world_imu.p.x(), 2.0);
  EXPECT_EQ(keeper.failed(), 0U);
}

TEST_F(LastPoseKeeperTest, RemovesWhatIsNoLongerTrue) {
  ASSERT_TRUE(write_last_pose(file_, last_pose_at(1.0)));
  LastPoseKeeper keeper(file_);
  keeper.keep(std::nullopt);
  run_to_the_end(keeper);
  EXPECT_FALSE(std::filesystem::exists(file_));
}

TEST_F(LastPoseKeeperTest, CountsWhatCouldNotBeWrittenAndGoesOn) {
  LastPoseKeeper keeper(folder_ / "not_there" / "last.tum");
  keeper.keep(last_pose_at(1.0));
  run_to_the_end(keeper);
  EXPECT_EQ(keeper.failed(), 1U);
}

TEST_F(LastPoseKeeperTest, WritesWhileItRuns) {
  LastPoseKeeper keeper(file_);
  std::jthread thread([&] { keeper.run(stop_); });
  keeper.keep(last_pose_at(3.0));
  for (int i = 0; i < 500 && !std::filesystem::exists(file_); ++i) {
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_TRUE(std::filesystem::exists(file_));
  stop_.set();
}

}  // namespace
}  // namespace topoloc::live

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/live/journal_replay.hpp"

#include "topoloc/live/messages.hpp"

#include "support/temporary_folder.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::live {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr std::int64_t kBegin_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kTick_ns = 5'000'000;
constexpr double kSpeed_mps = 10.0;
constexpr std::uint64_t kTicks = 2000;

RigidTransform pose_at(double x_m) { return {Eigen::Matrix3d::Identity(), {x_m, 0.0, 0.0}}; }

/// Of a car that drives along x.
TickInput tick_of(std::uint64_t number) {
  TickInput tick;
  tick.tick = number;
  tick.now_ns = kBegin_ns + static_cast<std::int64_t>(number) * kTick_ns;
  if (number % 2 == 0) {
    tick.imu_count = 1;
    tick.imu[0] = {tick.now_ns, {0.0, 0.0, 9.81}, Eigen::Vector3d::Zero()};
    tick.speed_count = 1;
    tick.speed[0] = {tick.now_ns, kSpeed_mps};
  }
  return tick;
}

/// Where it is, starting from zero with tick 10.
double x_at(std::int64_t time_ns) {
  return kSpeed_mps * 1e-9 * static_cast<double>(time_ns - kBegin_ns - 10 * kTick_ns);
}

class JournalReplay : public ::testing::Test {
 protected:
  /// A run and its journal, in many small files. `change`: what was given besides.
  void record(bool with_poses, const std::function<void(TickInput&)>& change) {
    TickRunner runner(config_);
    JournalWriter journal(folder_ / "flight", 8 * 100'000, {"1.2", ""});
    for (std::uint64_t i = 0; i < kTicks; ++i) {
      TickInput tick = tick_of(i);
      change(tick);
      const TickOutput& output = runner.run(tick, nullptr);
      recorded_.push_back(output);
      std::optional<estimation::InitialPose> after;
      if (with_poses && has_pose(output)) {
        after = {output.estimate.time_ns, output.estimate.state.T_world_imu()};
      }
      journal.add(tick, after);
    }
    journal.close();
  }
  /// From tick 10 on.
  void record_run() {
    record(true, [](TickInput& tick) {
      if (tick.tick == 10) {
        tick.initial_pose = {tick.now_ns, pose_at(0.0)};
      }
    });
  }
  ReplaySummary replay(const std::optional<RigidTransform>& initial_pose = {}) {
    return replay_journal(folder_ / "flight", config_, initial_pose,
                          [this](const TickOutput& output) { replayed_.push_back(output); });
  }
  /// As when the ring of files has gone round.
  void remove_first_file() { std::filesystem::remove(journal_files(folder_ / "flight").front()); }

  testing::TemporaryFolder folder_;
  estimation::EstimatorConfig config_;
  std::vector<TickOutput> recorded_;
  std::vector<TickOutput> replayed_;
};

TEST_F(JournalReplay, OfAWholeRunIsExact) {
  record_run();
  const ReplaySummary summary = replay();
  EXPECT_TRUE(summary.is_exact());
  EXPECT_EQ(summary.ticks, kTicks);
  ASSERT_EQ(replayed_.size(), recorded_.size());
  EXPECT_EQ(replayed_.back().estimate.state.p_world_imu,
            recorded_.back().estimate.state.p_world_imu);
  EXPECT_EQ(replayed_.back().estimate.P, recorded_.back().estimate.P);
}

TEST_F(JournalReplay, InTheMiddleOfARunStartsFromThePoseThatTheFileBeginsWith) {
  record_run();
  remove_first_file();
  const ReplaySummary summary = replay();
  EXPECT_FALSE(summary.is_exact());
  EXPECT_EQ(summary.started, 1U);
  EXPECT_LT(summary.left_out, 10U);
  ASSERT_GT(replayed_.size(), 100U);
  EXPECT_GT(replayed_.front().tick, 20U);
  for (const TickOutput& output : {replayed_.front(), replayed_.back()}) {
    EXPECT_NEAR(output.estimate.state.p_world_imu.x(), x_at(output.now_ns), 0.2);
  }
}

TEST_F(JournalReplay, StartsFromAPoseThatIsGiven) {
  record_run();
  remove_first_file();
  const ReplaySummary summary = replay(pose_at(500.0));
  EXPECT_FALSE(summary.is_exact());
  EXPECT_EQ(summary.started, 1U);
  EXPECT_NEAR(replayed_.front().estimate.state.p_world_imu.x(), 500.0, 0.5);
}

TEST_F(JournalReplay, StartsAgainBehindAGapAlthoughAPoseWasGiven) {
  record_run();
  const auto files = journal_files(folder_ / "flight");
  ASSERT_GE(files.size(), 4U);
  std::filesystem::remove(files[0]);
  std::filesystem::remove(files[2]);
  const ReplaySummary summary = replay(pose_at(500.0));
  EXPECT_EQ(summary.started, 2U);
  EXPECT_TRUE(summary.started_from_given);
  EXPECT_NEAR(replayed_.front().estimate.state.p_world_imu.x(), 500.0, 0.5);
  EXPECT_NEAR(replayed_.back().estimate.state.p_world_imu.x(), x_at(replayed_.back().now_ns), 0.2);
}

// As a live process does with the last pose, which it offers until there is a wheel speed.
TEST_F(JournalReplay, StartsAWholeRunFromAPoseThatIsGivenInPlaceOfItsOwn) {
  for (const std::uint64_t first_speed : {10U, 500U}) {
    std::filesystem::remove_all(folder_ / "flight");
    replayed_.clear();
    record(true, [&](TickInput& tick) {
      if (tick.tick < first_speed) {
        tick.speed_count = 0;
      }
      if (tick.tick <= first_speed && tick.imu_count > 0) {
        tick.initial_pose = {tick.imu[0].time_ns, pose_at(0.0)};
      }
    });
    const ReplaySummary summary = replay(pose_at(500.0));
    EXPECT_FALSE(summary.is_exact());
    EXPECT_EQ(summary.started, 1U);
    EXPECT_TRUE(summary.started_from_given);
    const TickOutput& last = replayed_.back();
    EXPECT_EQ(last.estimate.counters.starts, 1U);
    const double way_m = 1e-9 * kSpeed_mps * static_cast<double>(kTicks - first_speed) * kTick_ns;
    EXPECT_NEAR(last.estimate.state.p_world_imu.x(), 500.0 + way_m, 10.0);
  }
}

TEST_F(JournalReplay, SaysThatThereWasNoStartFromThePoseGiven) {
  record(false, [](TickInput& tick) { tick.speed_count = 0; });
  const ReplaySummary summary = replay(pose_at(500.0));
  EXPECT_FALSE(summary.is_exact());
  EXPECT_FALSE(summary.started_from_given);
  EXPECT_EQ(summary.started, 0U);
}

TEST_F(JournalReplay, GoesOnBehindAFileThatCannotBeRead) {
  record_run();
  const auto files = journal_files(folder_ / "flight");
  ASSERT_GE(files.size(), 4U);
  std::filesystem::resize_file(files[2], 0);
  const ReplaySummary summary = replay();
  EXPECT_FALSE(summary.is_exact());
  EXPECT_EQ(summary.started, 1U);
  EXPECT_EQ(summary.journal.unreadable, 1U);
  EXPECT_NEAR(replayed_.back().estimate.state.p_world_imu.x(), x_at(replayed_.back().now_ns), 0.2);
}

TEST_F(JournalReplay, LeavesOutWhatWasBeforeAPoseThatTheFilterTook) {
  record(false, [](TickInput& tick) {
    if (tick.tick == 1000) {
      tick.initial_pose = {tick.now_ns, {2.0 * Eigen::Matrix3d::Identity(), {0.0, 0.0, 0.0}}};
    } else if (tick.tick == 1200) {
      tick.initial_pose = {tick.now_ns, pose_at(7.0)};
    }
  });
  remove_first_file();
  const ReplaySummary summary = replay();
  EXPECT_FALSE(summary.is_exact());
  EXPECT_EQ(summary.started, 0U);
  EXPECT_EQ(replayed_.front().tick, 1200U);
  EXPECT_EQ(summary.ticks, kTicks - 1200U);
}

TEST_F(JournalReplay, WithoutAPoseIsRefusedAndSaysWhatToDo) {
  record(false, [](TickInput&) {});
  remove_first_file();
  EXPECT_THAT([&] { replay(); }, ThrowsMessage<std::runtime_error>(HasSubstr("--initial-pose")));
  EXPECT_GT(replay(pose_at(1.0)).ticks, 1000U);
}

}  // namespace
}  // namespace topoloc::live

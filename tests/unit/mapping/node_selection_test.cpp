// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/node_selection.hpp"

#include "topoloc/geometry/so3.hpp"

#include <limits>
#include <numbers>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::mapping {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::int64_t kFrame_ns = 100'000'000;
constexpr double kDegree = std::numbers::pi / 180.0;

/// Poses at the frames' times: `step_m` along x and `step_rad` about z from one to the next.
evaluation::Trajectory way(int frames, double step_m, double step_rad = 0.0) {
  evaluation::Trajectory trajectory;
  for (int i = 0; i < frames; ++i) {
    trajectory.push_back(
        {i * kFrame_ns, {so3::exp({0.0, 0.0, i * step_rad}), {i * step_m, 0.0, 0.0}}});
  }
  return trajectory;
}

std::vector<std::int64_t> frame_times(int frames) {
  std::vector<std::int64_t> times_ns;
  for (int i = 0; i < frames; ++i) {
    times_ns.push_back(i * kFrame_ns);
  }
  return times_ns;
}

std::vector<std::size_t> chosen(const Selection& selection) {
  std::vector<std::size_t> frames;
  for (const PlannedNode& node : selection.nodes) {
    frames.push_back(node.frame);
  }
  return frames;
}

TEST(NodeSelection, TakesTheFrameNearestToTheSpacing) {
  // 4.8 m is nearer to 5 m than 5.6 m, 6.4 m nearer than 3.2 m.
  EXPECT_THAT(chosen(select_nodes(frame_times(11), way(11, 1.0), {})), ElementsAre(0, 5, 10));
  EXPECT_THAT(chosen(select_nodes(frame_times(13), way(13, 0.8), {})), ElementsAre(0, 6, 12));
  EXPECT_THAT(chosen(select_nodes(frame_times(6), way(6, 3.2), {})), ElementsAre(0, 2, 4));
}

TEST(NodeSelection, GivesTimeAndPoseOfTheFrame) {
  const Selection selection = select_nodes(frame_times(11), way(11, 1.0), {});
  ASSERT_EQ(selection.nodes.size(), 3U);
  EXPECT_EQ(selection.nodes[1].time_ns, 5 * kFrame_ns);
  EXPECT_NEAR(selection.nodes[1].T_world_imu.p.x(), 5.0, 1e-12);
  EXPECT_NEAR(selection.travelled_m, 10.0, 1e-12);
}

TEST(NodeSelection, InterpolatesThePoseOfAFrameBetweenTwoPoses) {
  const std::vector<std::int64_t> times_ns{kFrame_ns / 4};
  const Selection selection = select_nodes(times_ns, way(2, 1.0, 0.1), {});
  ASSERT_EQ(selection.nodes.size(), 1U);
  EXPECT_NEAR(selection.nodes[0].T_world_imu.p.x(), 0.25, 1e-12);
  EXPECT_NEAR(so3::log(selection.nodes[0].T_world_imu.R).z(), 0.025, 1e-12);
}

TEST(NodeSelection, StandingVehicleGetsOneNode) {
  const Selection selection = select_nodes(frame_times(50), way(50, 0.0), {});
  EXPECT_THAT(chosen(selection), ElementsAre(0));
  EXPECT_DOUBLE_EQ(selection.travelled_m, 0.0);
}

TEST(NodeSelection, TurnCallsForANodeWithoutDistance) {
  // 4 degrees a frame: 15 degrees are exceeded with every fourth.
  EXPECT_THAT(chosen(select_nodes(frame_times(10), way(10, 0.01, 4.0 * kDegree), {})),
              ElementsAre(0, 4, 8));
  EXPECT_THAT(chosen(select_nodes(frame_times(10), way(10, 0.01, -4.0 * kDegree), {})),
              ElementsAre(0, 4, 8));
}

TEST(NodeSelection, ParityKeepsTheTwoHalvesApart) {
  const Selection even =
      select_nodes(frame_times(21), way(21, 1.0), {.frames = FrameParity::kEven});
  const Selection odd = select_nodes(frame_times(21), way(21, 1.0), {.frames = FrameParity::kOdd});
  EXPECT_THAT(chosen(even), ElementsAre(0, 4, 8, 12, 16, 20));
  EXPECT_THAT(chosen(odd), ElementsAre(1, 5, 9, 13, 17));
  EXPECT_EQ(even.frames_of_other_parity, 10U);
  EXPECT_EQ(odd.frames_of_other_parity, 11U);
}

TEST(NodeSelection, CountsFramesBeforeAndAfterTheTrajectory) {
  evaluation::Trajectory trajectory = way(20, 1.0);
  trajectory.erase(trajectory.begin(), trajectory.begin() + 3);
  trajectory.resize(10);  // frames 3 to 12
  const Selection selection = select_nodes(frame_times(20), trajectory, {});
  EXPECT_THAT(chosen(selection), ElementsAre(3, 8));
  EXPECT_EQ(selection.frames_without_pose, 10U);
  EXPECT_NEAR(selection.travelled_m, 9.0, 1e-12);
}

TEST(NodeSelection, DoesNotInterpolateAcrossAGap) {
  evaluation::Trajectory trajectory = way(31, 1.0);
  trajectory.erase(trajectory.begin() + 11, trajectory.begin() + 20);  // 1 s without a pose
  const Selection with_gap = select_nodes(frame_times(31), trajectory, {});
  EXPECT_THAT(chosen(with_gap), ElementsAre(0, 5, 10, 20, 25, 30));
  EXPECT_EQ(with_gap.frames_without_pose, 9U);

  const Selection bridged =
      select_nodes(frame_times(31), trajectory, {.max_pose_gap_ns = 1'000'000'000});
  EXPECT_THAT(chosen(bridged), ElementsAre(0, 5, 10, 15, 20, 25, 30));
  EXPECT_EQ(bridged.frames_without_pose, 0U);
}

TEST(NodeSelection, NoFramesGiveNoNodes) {
  EXPECT_THAT(select_nodes({}, way(3, 1.0), {}).nodes, IsEmpty());
}

TEST(NodeSelection, RefusesSpacingThatIsNotPositive) {
  const auto times_ns = frame_times(3);
  const auto trajectory = way(3, 1.0);
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(select_nodes(times_ns, trajectory, {.every_m = bad}), std::invalid_argument);
    EXPECT_THROW(select_nodes(times_ns, trajectory, {.every_rad = bad}), std::invalid_argument);
  }
}

}  // namespace
}  // namespace topoloc::mapping

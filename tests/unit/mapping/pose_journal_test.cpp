// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "mapping/pose_journal.hpp"

#include "topoloc/geometry/so3.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace topoloc::mapping {
namespace {

std::vector<RefinedPose> some_poses() {
  std::vector<RefinedPose> poses(2);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    RefinedPose& pose = poses[i];
    const auto x = static_cast<double>(i + 1);
    pose.frame = 7 * i;
    pose.time_ns = 1'700'000'000'123'456'789 + static_cast<std::int64_t>(i);
    pose.T_world_imu = {so3::exp({0.1 * x, -1.0 / 3.0, 2.0}), {1.0 / 3.0, -1e-17, 4e5 + 0.1 * x}};
    pose.covariance.setConstant(std::sqrt(2.0) * 1e-9 * x);
    pose.figures = {{"pose_std_m", 0.1 * x}, {"track_residual_px", 1.0 / 7.0}};
  }
  poses[1].rejected = NodeReject::kPoseUncertain;
  return poses;
}

TEST(PoseJournal, GivesPosesBackToTheLastBit) {
  std::vector<RefinedPose> poses = some_poses();
  poses[0].figures["registration_away_m"] = std::numeric_limits<double>::infinity();
  const auto read = parse_poses(poses_text(poses, "a\nb: \"c\"\n"), "a\nb: \"c\"\n");
  ASSERT_TRUE(read.has_value());
  ASSERT_EQ(read->size(), 2U);
  poses[0].figures.erase("registration_away_m");  // no map holds it
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ((*read)[i].frame, poses[i].frame);
    EXPECT_EQ((*read)[i].time_ns, poses[i].time_ns);
    EXPECT_EQ((*read)[i].T_world_imu.R, poses[i].T_world_imu.R);
    EXPECT_EQ((*read)[i].T_world_imu.p, poses[i].T_world_imu.p);
    EXPECT_EQ((*read)[i].covariance, poses[i].covariance);
    EXPECT_EQ((*read)[i].rejected, poses[i].rejected);
    EXPECT_EQ((*read)[i].figures, poses[i].figures);
  }
}

TEST(PoseJournal, KnowsWhatIsNotItsOwn) {
  const std::string text = poses_text(some_poses(), "mine");
  ASSERT_TRUE(parse_poses(text, "mine").has_value());
  EXPECT_FALSE(parse_poses(text, "yours").has_value());
  EXPECT_FALSE(parse_poses("", "mine").has_value());
  EXPECT_FALSE(parse_poses("{}", "mine").has_value());
  for (const std::size_t cut : {text.size() / 3, text.size() / 2, text.size() - 1}) {
    EXPECT_FALSE(parse_poses(text.substr(0, cut), "mine").has_value()) << cut;
  }
  std::string other = text;
  other.replace(other.find("pose_uncertain"), 14, "pose_unheardof");
  EXPECT_FALSE(parse_poses(other, "mine").has_value());
}

}  // namespace
}  // namespace topoloc::mapping

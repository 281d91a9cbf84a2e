// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/trajectory_refiner.hpp"

#include "refinement/keyframes.hpp"
#include "unit/refinement/template_matcher.hpp"
#include "unit/refinement/turning_drive.hpp"

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A drive with an even image every 50 ms.
class TrajectoryRefinerTest : public ::testing::Test {
 protected:
  static constexpr std::int64_t kFrame_us = 50'000;

  TrajectoryRefinerTest() {
    std::vector<image_t> images;
    for (int i = 0; i <= 80; ++i) {
      images.push_back(testing::jpeg_image(TurningDrive::kStart_us + kFrame_us * i,
                                           cv::Mat(32, 64, CV_8UC1, cv::Scalar(128))));
    }
    folder_.folder.write_images(images);
    drive_ = folder_.load();
  }

  static evaluation::Trajectory trajectory(double from_s, double to_s) {
    constexpr double kStep_s = 0.1;
    evaluation::Trajectory result;
    for (double t = from_s; t <= to_s + 1e-9; t += kStep_s) {
      result.push_back({1000 * TurningDrive::kStart_us + static_cast<std::int64_t>(1e9 * t),
                        TurningDrive::pose_at_s(t)});
    }
    return result;
  }
  static PoseKnowledge with_trajectory() {
    return {.trajectory = trajectory(0.0, TurningDrive::kSeconds), .initial_pose = std::nullopt};
  }
  static PoseKnowledge with_initial_pose(const RigidTransform& pose = {}) {
    return {.trajectory = std::nullopt, .initial_pose = pose};
  }
  [[nodiscard]] std::vector<Keyframe> keyframes(const PoseKnowledge& knowledge,
                                                const RefinementConfig& config = {}) const {
    return choose_keyframes(drive_, knowledge, drive::open_frames(drive_), config);
  }
  [[nodiscard]] std::string complaint(const mapping::CloudGrid& grid) const {
    drive::FrameLog frames = drive::open_frames(drive_);
    RefinementConfig quick;
    quick.camera_scale = 0.5;
    quick.window.fine_passes = 0;
    TrajectoryRefiner refiner(drive_, with_trajectory(), quick);
    try {
      refiner.refine(grid, frames, {});
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    ADD_FAILURE() << "no complaint";
    return "";
  }

  TurningDrive folder_;
  drive::Drive drive_;
};

TEST_F(TrajectoryRefinerTest, NeedsATrajectoryOrAnInitialPoseNotBoth) {
  EXPECT_NO_THROW(TrajectoryRefiner(drive_, with_trajectory(), {}));
  EXPECT_NO_THROW(TrajectoryRefiner(drive_, with_initial_pose(), {}));
  EXPECT_THROW(TrajectoryRefiner(drive_, PoseKnowledge{}, {}), std::invalid_argument);
  PoseKnowledge both_known = with_trajectory();
  both_known.initial_pose = RigidTransform{};
  EXPECT_THROW(TrajectoryRefiner(drive_, both_known, {}), std::invalid_argument);
}

TEST_F(TrajectoryRefinerTest, RefusesACloudWithoutIntensity) {
  mapping::PointCloud cloud;
  cloud.positions_m.emplace_back(1.0F, 2.0F, 3.0F);
  cloud.intensities.push_back(0.0F);
  EXPECT_THAT(complaint(mapping::CloudGrid(std::move(cloud))), HasSubstr("no intensities"));
}

TEST_F(TrajectoryRefinerTest, RefusesACloudThatTheCameraDoesNotSee) {
  mapping::PointCloud cloud;
  cloud.has_intensity = true;
  for (const float intensity : {1.0F, 2.0F}) {
    cloud.positions_m.emplace_back(500.0F, 0.0F, 0.0F);
    cloud.intensities.push_back(intensity);
  }
  EXPECT_THAT(complaint(mapping::CloudGrid(std::move(cloud))), HasSubstr("elsewhere"));
}

TEST_F(TrajectoryRefinerTest, NamesItsRoutes) {
  const auto name = [&](Routes routes) {
    RefinementConfig config;
    config.routes = routes;
    return TrajectoryRefiner(drive_, with_trajectory(), config, std::make_unique<BlindMatcher>())
        .name();
  };
  EXPECT_EQ(name(Routes::kAuto), "auto");
  EXPECT_EQ(name(Routes::kCorrelation), "correlation");
  EXPECT_EQ(name(Routes::kMatches), "matches");
  for (const Routes routes : {Routes::kAuto, Routes::kCorrelation, Routes::kMatches}) {
    EXPECT_EQ(parse_routes(name(routes)), routes);
  }
  EXPECT_THROW(parse_routes("none"), std::invalid_argument);
}

TEST_F(TrajectoryRefinerTest, TakesAKeyframeAMetre) {
  const auto chosen = keyframes(with_trajectory());
  // 0.4 m a frame: every third.
  ASSERT_EQ(chosen.size(), 27U);
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    EXPECT_EQ(chosen[k].frame, 3 * k);
    const double t = TurningDrive::seconds(chosen[k].time_ns);
    ASSERT_TRUE(chosen[k].T_prior.has_value());
    EXPECT_LT((chosen[k].T_prior->p - TurningDrive::pose_at_s(t).p).norm(), 0.01);
    EXPECT_LT((chosen[k].T_odometry.p - TurningDrive::pose_at_s(t).p).norm(), 0.2);
  }
  EXPECT_FALSE(keyframes(with_initial_pose()).front().T_prior.has_value());
}

TEST_F(TrajectoryRefinerTest, TakesAViewEveryTwoMetresHoweverFarKeyframesAreApart) {
  const auto views = [&](mapping::FrameParity frames, double keyframe_m = 1.0) {
    RefinementConfig config;
    config.frames = frames;
    config.keyframe_m = keyframe_m;
    std::vector<bool> result;
    for (const Keyframe& keyframe : keyframes(with_trajectory(), config)) {
      result.push_back(keyframe.is_view);
    }
    result.resize(6);
    return result;
  };
  // 1.2 m, 1.6 m and 0.4 m a keyframe.
  EXPECT_THAT(views(mapping::FrameParity::kAll),
              ElementsAre(true, false, true, false, true, false));
  EXPECT_THAT(views(mapping::FrameParity::kOdd), ElementsAre(true, true, true, true, true, true));
  EXPECT_THAT(views(mapping::FrameParity::kAll, 0.3),
              ElementsAre(true, false, false, false, false, true));
}

TEST_F(TrajectoryRefinerTest, TakesKeyframesOnlyOfTheFramesAsked) {
  RefinementConfig config;
  config.frames = mapping::FrameParity::kOdd;
  for (const Keyframe& keyframe : keyframes(with_trajectory(), config)) {
    EXPECT_EQ(keyframe.frame % 2, 1U);
  }
}

TEST_F(TrajectoryRefinerTest, TakesNoKeyframesOutsideTheTrajectory) {
  const auto chosen = keyframes({.trajectory = trajectory(1.0, 3.0), .initial_pose = std::nullopt});
  ASSERT_FALSE(chosen.empty());
  EXPECT_GE(TurningDrive::seconds(chosen.front().time_ns), 1.0 - 1e-9);
  EXPECT_LE(TurningDrive::seconds(chosen.back().time_ns), 3.0 + 1e-9);
}

TEST_F(TrajectoryRefinerTest, NamesTheDriveThatHasNoKeyframe) {
  evaluation::Trajectory an_hour_later = trajectory(0.0, 1.0);
  for (evaluation::StampedPose& pose : an_hour_later) {
    pose.time_ns -= 3'600'000'000'000;
  }
  EXPECT_THROW(keyframes({.trajectory = an_hour_later, .initial_pose = std::nullopt}),
               std::runtime_error);
}

}  // namespace
}  // namespace topoloc::refinement

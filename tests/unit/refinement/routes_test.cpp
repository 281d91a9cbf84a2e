// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/trajectory_refiner.hpp"

#include "support/drive_folder.hpp"
#include "support/temporary_folder.hpp"
#include "unit/refinement/template_matcher.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

/// A drive of 24 m along a textured street, and its cloud.
class StreetDrive {
 public:
  StreetDrive() {
    constexpr std::int64_t kStart_us = 1'700'000'000'000'000;
    constexpr double kSpeed_mps = 5.0;
    constexpr std::int64_t kFrame_us = 200'000;
    constexpr int kFrames = 25;
    constexpr std::int64_t kSample_us = 10'000;
    folder_.write_vehicle_with("matching: {width_px: 400, height_px: 240, focal_px: 260}\n");
    const TexturedStreet street(1);
    std::vector<image_t> images;
    const auto pose = [&](std::int64_t time_us) {
      return TexturedStreet::vehicle_at(1e-6 * kSpeed_mps * static_cast<double>(time_us));
    };
    // The camera of a DriveFolder sits where the IMU is.
    const RigidTransform T_imu_cam{TexturedStreet::T_imu_cam().R, Eigen::Vector3d::Zero()};
    for (std::int64_t t = 0; t < kFrames * kFrame_us; t += kFrame_us) {
      images.push_back(testing::jpeg_image(kStart_us + t, street.photo(pose(t) * T_imu_cam)));
      trajectory.push_back({1000 * (kStart_us + t), pose(t)});
    }
    folder_.write_images(images);
    std::vector<testing::CanRow> rows;
    for (std::int64_t t = 0; t < kFrames * kFrame_us; t += kSample_us) {
      rows.push_back({.time_us = kStart_us + t, .speed_mps = kSpeed_mps});
    }
    folder_.write_can_log(rows);
    drive = drive::load_drive(folder_.dir());
  }

 private:
  testing::TemporaryFolder temporary_;
  testing::DriveFolder folder_{temporary_ / "drive", TexturedStreet::camera()};

 public:
  drive::Drive drive;
  evaluation::Trajectory trajectory;
  mapping::CloudGrid cloud = TexturedStreet(1).scan();
};

class RouteChoice : public ::testing::Test {
 protected:
  struct Result {
    std::vector<mapping::RefinedPose> poses;
    std::vector<RegistrationAttempt> attempts;

    [[nodiscard]] std::ptrdiff_t count(Route route, bool accepted) const {
      return std::count_if(attempts.begin(), attempts.end(), [&](const RegistrationAttempt& a) {
        return a.found.route == route && (a.accepted || !accepted);
      });
    }
  };

  static StreetDrive& street() {
    static StreetDrive drive;
    return drive;
  }
  static Result refined(Routes routes, std::unique_ptr<matching::ImagePairMatcher> matcher,
                        int threads = 0) {
    RefinementConfig config;
    config.routes = routes;
    config.camera_scale = 1.0;
    config.window.fine_passes = 0;
    config.fruitless_views = 4;
    config.threads = threads;
    PoseKnowledge knowledge;
    knowledge.trajectory = street().trajectory;
    for (evaluation::StampedPose& pose : *knowledge.trajectory) {
      pose.T_world_imu.p += Eigen::Vector3d(0.1, 0.15, -0.1);
    }
    TrajectoryRefiner refiner(street().drive, knowledge, config, std::move(matcher));
    drive::FrameLog frames = drive::open_frames(street().drive);
    Result result;
    result.poses = refiner.refine(street().cloud, frames, {});
    result.attempts.assign(refiner.attempts().begin(), refiner.attempts().end());
    return result;
  }
  /// Median distance from the truth [m].
  static double error_m(const Result& result) {
    std::vector<double> errors;
    for (const mapping::RefinedPose& pose : result.poses) {
      const auto T = evaluation::pose_at(street().trajectory, pose.time_ns, 500'000'000);
      errors.push_back((pose.T_world_imu.p - T->p).norm());
    }
    std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
    return errors.at(errors.size() / 2);
  }
};

TEST_F(RouteChoice, MatchesAloneRefineADriveWhereTheyAreGood) {
  const Result result = refined(Routes::kMatches, std::make_unique<TemplateMatcher>());
  EXPECT_EQ(result.count(Route::kCorrelation, false), 0);
  EXPECT_GE(result.count(Route::kMatches, true), 8);
  EXPECT_LT(error_m(result), 0.12);
}

TEST_F(RouteChoice, MatchesAloneRefuseADriveWhereTheyFail) {
  EXPECT_THROW(refined(Routes::kMatches, std::make_unique<BlindMatcher>()), std::runtime_error);
}

TEST_F(RouteChoice, AutoTakesMatchesWhereTheyAreGood) {
  const Result result = refined(Routes::kAuto, std::make_unique<TemplateMatcher>());
  EXPECT_GE(result.count(Route::kMatches, true), 6);
  EXPECT_LT(error_m(result), 0.12);
}

TEST_F(RouteChoice, AutoTakesCorrelationWhereMatchesFail) {
  const Result result = refined(Routes::kAuto, std::make_unique<BlindMatcher>());
  EXPECT_EQ(result.count(Route::kMatches, true), 0);
  EXPECT_GE(result.count(Route::kCorrelation, true), 2);
  EXPECT_LT(error_m(result), 0.12);
}

TEST_F(RouteChoice, AutoGivesUpOnMatchesThatNeverFind) {
  // After the first stretch.
  EXPECT_EQ(refined(Routes::kAuto, std::make_unique<BlindMatcher>()).count(Route::kMatches, false),
            static_cast<std::ptrdiff_t>(WindowConfig{}.stride));
}

TEST_F(RouteChoice, FailedMatchesLeaveNoTraceInThePoses) {
  const Result both = refined(Routes::kAuto, std::make_unique<BlindMatcher>());
  const Result alone = refined(Routes::kCorrelation, nullptr);
  ASSERT_EQ(both.poses.size(), alone.poses.size());
  for (std::size_t i = 0; i < both.poses.size(); ++i) {
    EXPECT_EQ(both.poses[i].T_world_imu.p, alone.poses[i].T_world_imu.p);
  }
}

TEST_F(RouteChoice, GiveTheSameBitsForAnyNumberOfThreads) {
  const Result one = refined(Routes::kAuto, std::make_unique<TemplateMatcher>(), 1);
  const Result three = refined(Routes::kAuto, std::make_unique<TemplateMatcher>(), 3);
  ASSERT_EQ(one.poses.size(), three.poses.size());
  for (std::size_t i = 0; i < one.poses.size(); ++i) {
    EXPECT_EQ(one.poses[i].T_world_imu.p, three.poses[i].T_world_imu.p);
    EXPECT_EQ(one.poses[i].T_world_imu.R, three.poses[i].T_world_imu.R);
  }
}

TEST_F(RouteChoice, NeedAMatcherUnlessByCorrelation) {
  EXPECT_THROW(refined(Routes::kAuto, nullptr), std::invalid_argument);
  EXPECT_THROW(refined(Routes::kMatches, nullptr), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::refinement

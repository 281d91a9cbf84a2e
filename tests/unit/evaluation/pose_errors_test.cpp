// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/pose_errors.hpp"

#include "topoloc/geometry/so3.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

namespace topoloc::evaluation {
namespace {

constexpr std::int64_t kDriveStep_ns = 100'000'000;
constexpr double kSpeed_mps = 10.0;
constexpr double kHeading_rad = 2.0;

/// 10 s at 10 Hz and 10 m/s, uphill, in a heading that is no axis of the world.
Trajectory straight_drive() {
  const Eigen::Matrix3d R =
      so3::exp({0, 0, kHeading_rad}) * so3::exp({0, -0.1, 0}) * so3::exp({0.02, 0, 0});
  const Eigen::Vector3d forward(std::cos(kHeading_rad), std::sin(kHeading_rad), 0.1);
  Trajectory trajectory;
  for (int i = 0; i <= 100; ++i) {
    trajectory.push_back({i * kDriveStep_ns, {R, forward * (kSpeed_mps * 0.1 * i)}});
  }
  return trajectory;
}

/// The trajectory with all positions moved in the drive's heading frame.
Trajectory moved(Trajectory trajectory, const Eigen::Vector3d& offset_m) {
  for (StampedPose& pose : trajectory) {
    pose.T_world_imu.p += so3::exp({0, 0, kHeading_rad}) * offset_m;
  }
  return trajectory;
}

PoseScores scores_of(const Trajectory& estimate, const MatchOptions& options = {}) {
  return score(match_errors(straight_drive(), estimate, options));
}

TEST(PoseErrors, AreZeroForTheReferenceItself) {
  const PoseScores scores = scores_of(straight_drive());
  EXPECT_EQ(scores.position_m.max, 0.0);
  EXPECT_LT(scores.rotation_rad.max, 1e-12);
  EXPECT_EQ(scores.coverage, 1.0);
  EXPECT_EQ(scores.matched, 101u);
}

TEST(PoseErrors, LongitudinalIsPositiveAheadAndLateralPositiveToTheLeft) {
  const PoseScores scores = scores_of(moved(straight_drive(), {0.3, 0.2, -0.1}));
  EXPECT_TRUE(scores.signed_mean_m.isApprox(Eigen::Vector3d(0.3, 0.2, -0.1), 1e-9));
  EXPECT_NEAR(scores.longitudinal_m.mean, 0.3, 1e-9);
  EXPECT_NEAR(scores.lateral_m.mean, 0.2, 1e-9);
  EXPECT_NEAR(scores.vertical_m.mean, 0.1, 1e-9);
  const PoseScores behind = scores_of(moved(straight_drive(), {-0.3, -0.2, 0.0}));
  EXPECT_TRUE(behind.signed_mean_m.isApprox(Eigen::Vector3d(-0.3, -0.2, 0.0), 1e-9));
  EXPECT_NEAR(behind.longitudinal_m.mean, 0.3, 1e-9);
}

TEST(PoseErrors, AreNeverAligned) {
  const PoseScores scores = scores_of(moved(straight_drive(), {0.0, 1.0, 0.0}));
  EXPECT_NEAR(scores.position_m.mean, 1.0, 1e-9);
  EXPECT_NEAR(scores.position_m.median, 1.0, 1e-9);
  EXPECT_NEAR(scores.position_m.rmse, 1.0, 1e-9);
}

TEST(PoseErrors, SignedMeansCancelWhereAbsoluteOnesDoNot) {
  Trajectory estimate = straight_drive();
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    estimate[i].T_world_imu.p.z() += i % 2 == 0 ? 0.5 : -0.5;
  }
  const PoseScores scores = scores_of(estimate);
  EXPECT_NEAR(scores.signed_mean_m.z(), 0.5 / 101.0, 1e-9);
  EXPECT_NEAR(scores.vertical_m.mean, 0.5, 1e-9);
}

TEST(PoseErrors, RotationIsRightAtZeroAtSmallAnglesAndAtPi) {
  for (const double angle_rad : {0.0, 1e-9, 1e-3, 1.0, M_PI}) {
    Trajectory estimate = straight_drive();
    for (StampedPose& pose : estimate) {
      pose.T_world_imu.R *= so3::exp(Eigen::Vector3d(1, 2, -2) / 3.0 * angle_rad);
    }
    const PoseScores scores = scores_of(estimate);
    EXPECT_NEAR(scores.rotation_rad.mean, angle_rad, 1e-10 + 1e-7 * angle_rad);
    EXPECT_EQ(scores.position_m.max, 0.0);
  }
}

TEST(PoseErrors, TimeShiftShowsAsLongitudinalErrorAndTimeOffset) {
  Trajectory estimate = straight_drive();
  for (StampedPose& pose : estimate) {
    pose.time_ns -= 50'000'000;  // shows the pose of 50 ms later
  }
  const PoseScores scores = scores_of(estimate);
  EXPECT_NEAR(scores.signed_mean_m.x(), 0.5, 1e-9);
  EXPECT_NEAR(scores.signed_mean_m.y(), 0.0, 1e-9);
  ASSERT_TRUE(scores.time_offset_s.has_value());
  EXPECT_NEAR(*scores.time_offset_s, 0.05, 1e-9);
}

TEST(PoseErrors, DriftIsTheHorizontalErrorBesideTheWayTravelled) {
  Trajectory estimate = straight_drive();
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    estimate[i].T_world_imu.p.z() += 7.0;  // not horizontal
    estimate[i].T_world_imu.p *= 1.0 + (i == 50 ? 0.5 : 0.0);
  }
  estimate.back().T_world_imu.p.head<2>() *= 1.02;
  const PoseScores scores = scores_of(estimate);
  EXPECT_NEAR(scores.travelled_m, 100.0 * std::sqrt(1.01), 1e-9) << "uphill";
  EXPECT_NEAR(scores.max_horizontal_m, 25.0, 1e-9);
  EXPECT_NEAR(scores.final_horizontal_m, 2.0, 1e-9);
}

TEST(PoseErrors, HaveNoTimeOffsetAtStandstill) {
  Trajectory still;
  for (int i = 0; i < 10; ++i) {
    still.push_back({i * kDriveStep_ns, {}});
  }
  EXPECT_FALSE(score(match_errors(still, still)).time_offset_s.has_value());
}

TEST(Coverage, CountsGapsLateStartAndEarlyEnd) {
  Trajectory estimate = straight_drive();
  estimate.erase(estimate.begin() + 40, estimate.begin() + 50);  // a gap of 1.1 s: 10 stamps lost
  EXPECT_EQ(scores_of(estimate).matched, 91u);
  EXPECT_EQ(scores_of(estimate).reference_poses, 101u);
  estimate.erase(estimate.begin(), estimate.begin() + 5);
  EXPECT_EQ(scores_of(estimate).matched, 86u);
  estimate.resize(estimate.size() - 20);
  EXPECT_EQ(scores_of(estimate).matched, 66u);
  EXPECT_NEAR(scores_of(estimate).coverage, 66.0 / 101.0, 1e-12);
}

TEST(Coverage, BridgesGapsUpToTheLimit) {
  Trajectory estimate = straight_drive();
  estimate.erase(estimate.begin() + 40);
  EXPECT_EQ(scores_of(estimate, {0.0, 2 * kDriveStep_ns}).matched, 101u);
  EXPECT_EQ(scores_of(estimate, {0.0, 2 * kDriveStep_ns - 1}).matched, 100u);
}

TEST(Coverage, FromSecondsCountsFromTheStartOfTheReferenceToItsEnd) {
  Trajectory estimate = straight_drive();
  estimate.erase(estimate.begin(), estimate.begin() + 19);  // starts at 1.9 s
  const MatchedErrors in_time = match_errors(straight_drive(), estimate, {2.0, kDriveStep_ns});
  EXPECT_EQ(in_time.begin_ns, 2'000'000'000);
  EXPECT_EQ(in_time.reference_poses, 81u);
  EXPECT_EQ(score(in_time).coverage, 1.0);

  estimate.erase(estimate.begin(), estimate.begin() + 51);  // starts at 7 s
  estimate.resize(estimate.size() - 10);                    // ends at 9 s
  const MatchedErrors late = match_errors(straight_drive(), estimate, {2.0, kDriveStep_ns});
  EXPECT_EQ(late.reference_poses, 81u);
  EXPECT_EQ(late.errors.size(), 21u);
}

TEST(MatchErrors, RefusesWhatCannotBeCompared) {
  const Trajectory reference = straight_drive();
  Trajectory elsewhen = reference;
  for (StampedPose& pose : elsewhen) {
    pose.time_ns += 1'000'000'000'000;
  }
  EXPECT_THROW(match_errors(reference, elsewhen), std::runtime_error);
  EXPECT_THROW(match_errors(reference, reference, {11.0, kDriveStep_ns}), std::runtime_error);
  EXPECT_THROW(match_errors(reference, {}), std::runtime_error);
  EXPECT_THROW(match_errors(reference, reference, {-1.0, kDriveStep_ns}), std::invalid_argument);
  EXPECT_THROW(
      match_errors(reference, reference, {std::numeric_limits<double>::quiet_NaN(), kDriveStep_ns}),
      std::invalid_argument);
}

TEST(Statistics, AreThoseOfTheMagnitudes) {
  const Statistics s = statistics({-4.0, 1.0, 2.0, -3.0, 0.0});
  EXPECT_DOUBLE_EQ(s.mean, 2.0);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(6.0));
  EXPECT_DOUBLE_EQ(s.median, 2.0);
  EXPECT_DOUBLE_EQ(s.p95, 3.8);
  EXPECT_DOUBLE_EQ(s.max, 4.0);
  EXPECT_THROW(statistics({}), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::evaluation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/odometry.hpp"

#include "topoloc/geometry/so3.hpp"

#include "unit/refinement/turning_drive.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

TEST(DeadReckon, FollowsATurn) {
  const TurningDrive drive;
  const evaluation::Trajectory trajectory =
      dead_reckon(drive.load(), 0.0, TurningDrive::pose_at_s(0.0)).motion;
  ASSERT_GT(trajectory.size(), 100U);
  EXPECT_EQ(trajectory.front().time_ns, 1000 * TurningDrive::kStart_us);
  EXPECT_NEAR(TurningDrive::seconds(trajectory.back().time_ns), TurningDrive::kSeconds, 0.02);
  for (const evaluation::StampedPose& pose : trajectory) {
    const Vector6 off = motion_between(TurningDrive::pose_at_s(TurningDrive::seconds(pose.time_ns)),
                                       pose.T_world_imu);
    EXPECT_LT(off.head<3>().norm(), 0.01);
    EXPECT_LT(off.tail<3>().norm(), 0.15);
  }
}

TEST(DeadReckon, HasStrictlyIncreasingTimes) {
  const TurningDrive drive;
  const evaluation::Trajectory trajectory =
      dead_reckon(drive.load(), 0.0, TurningDrive::pose_at_s(0.0)).motion;
  EXPECT_TRUE(std::is_sorted(trajectory.begin(), trajectory.end(),
                             [](const auto& a, const auto& b) { return a.time_ns <= b.time_ns; }));
}

TEST(DeadReckon, StartsWhereItIsToldTo) {
  const TurningDrive drive;
  const RigidTransform elsewhere{so3::exp({0.0, 0.0, 1.0}), {100.0, -50.0, 7.0}};
  const evaluation::Trajectory trajectory = dead_reckon(drive.load(), 1.0, elsewhere).motion;
  ASSERT_FALSE(trajectory.empty());
  EXPECT_NEAR(TurningDrive::seconds(trajectory.front().time_ns), 1.0, 0.02);
  EXPECT_LT(motion_between(elsewhere, trajectory.front().T_world_imu).norm(), 0.15);
  // It is the same motion from there.
  const RigidTransform T_expected =
      elsewhere * TurningDrive::pose_at_s(1.0).inverse() *
      TurningDrive::pose_at_s(TurningDrive::seconds(trajectory.back().time_ns));
  EXPECT_LT(motion_between(T_expected, trajectory.back().T_world_imu).norm(), 0.2);
}

TEST(DeadReckon, LeavesAGyroBiasToThePoseGraph) {
  // An error of the rate that the filter would explain by itself comes out as a turn.
  constexpr double kBias_radps = 0.004;
  const TurningDrive drive(kBias_radps);
  const evaluation::Trajectory trajectory =
      dead_reckon(drive.load(), 0.0, TurningDrive::pose_at_s(0.0)).motion;
  const double seconds = TurningDrive::seconds(trajectory.back().time_ns);
  const Vector6 off =
      motion_between(TurningDrive::pose_at_s(seconds), trajectory.back().T_world_imu);
  EXPECT_NEAR(off(2), kBias_radps * seconds, 0.02 * kBias_radps * seconds);
}

TEST(DeadReckon, TakesRotationsFromTheGyroAloneAndUpFromTheFilter) {
  // It starts with a tilt that the filter soon mends: mending is not motion.
  const RigidTransform tilted =
      TurningDrive::pose_at_s(0.0) * RigidTransform{so3::exp({0.03, -0.03, 0.0}), {0.0, 0.0, 0.0}};
  const TurningDrive drive;
  const DeadReckoning reckoned = dead_reckon(drive.load(), 0.0, tilted);
  ASSERT_EQ(reckoned.filtered.size(), reckoned.motion.size());
  ASSERT_EQ(reckoned.filtered.size(), reckoned.tilt_std_rad.size());
  const double seconds = TurningDrive::seconds(reckoned.filtered.back().time_ns);
  const RigidTransform T_true = TurningDrive::pose_at_s(seconds);
  const auto tilt = [&](const RigidTransform& T) { return (T.R.row(2) - T_true.R.row(2)).norm(); };
  EXPECT_LT(tilt(reckoned.filtered.back().T_world_imu), 0.01);
  EXPECT_NEAR(tilt(reckoned.motion.back().T_world_imu), 0.03 * std::sqrt(2.0), 0.003);
  const Eigen::Matrix3d R_turned =
      reckoned.motion.front().T_world_imu.R.transpose() * reckoned.motion.back().T_world_imu.R;
  EXPECT_LT((R_turned - T_true.R).norm(), 0.003);
  EXPECT_GT(reckoned.tilt_std_rad.front(), 5.0 * reckoned.tilt_std_rad.back());
}

/// What an IMU on a vehicle that goes straight shows.
struct Felt {
  double forward_mps2 = 0.0;
  double up_mps2 = 9.81;
  double pitch_rate_radps = 0.0;
  double yaw_rate_radps = 0.0;
};

/// Dead reckoning of a vehicle that stands at first; `felt(i, speed_mps)` every 10 ms.
template <typename Function>
DeadReckoning reckoned_straight(int last, const Function& felt) {
  const testing::TemporaryFolder temporary;
  testing::DriveFolder folder(temporary / "drive", testing::tiny_camera());
  std::vector<testing::CanRow> rows;
  double speed_mps = 0.0;
  for (int i = 0; i <= last; ++i) {
    const Felt now = felt(i, speed_mps);
    rows.push_back({.time_us = TurningDrive::kStart_us + 10'000 * i,
                    .specific_force_mps2 = {now.forward_mps2, 0.0, now.up_mps2},
                    .angular_rate_radps = {0.0, now.pitch_rate_radps, now.yaw_rate_radps},
                    .speed_mps = speed_mps});
    speed_mps = std::max(0.0, speed_mps + 0.01 * now.forward_mps2);
  }
  folder.write_can_log(rows);
  return dead_reckon(drive::load_drive(folder.dir()), 0.0, {});
}

TEST(DeadReckon, StandsWhereTheVehicleStands) {
  // Standing, the filter sees that the gyro's bias has changed since it last stood, and moves to
  // where the way so far must have led.
  constexpr double kBias_radps = 0.0005;
  constexpr double kForce_mps2 = 2.5;
  const DeadReckoning reckoned = reckoned_straight(5500, [](int i, double speed_mps) -> Felt {
    if (i < 500) {
      return {};
    }
    if (i < 4500) {
      return {.forward_mps2 = speed_mps < 10.0 ? kForce_mps2 : 0.0, .yaw_rate_radps = kBias_radps};
    }
    return {.forward_mps2 = speed_mps > 1e-9 ? -kForce_mps2 : 0.0,
            .yaw_rate_radps = i < 4900 ? kBias_radps : 2.0 * kBias_radps};
  });
  const auto moved_m = [](const evaluation::Trajectory& trajectory) {
    const auto standing = std::find_if(trajectory.begin(), trajectory.end(), [](const auto& pose) {
      return pose.time_ns > 1000 * (TurningDrive::kStart_us + 49'300'000);
    });
    return (trajectory.back().T_world_imu.p - standing->T_world_imu.p).norm();
  };
  EXPECT_GT(moved_m(reckoned.filtered), 0.3);
  EXPECT_LT(moved_m(reckoned.motion), 0.03);
}

TEST(DeadReckon, NeitherSinksNorTurnsByBiasesThatStandingTells) {
  constexpr double kBias_mps2 = 0.15;
  constexpr double kBias_radps = 0.006;
  const DeadReckoning reckoned = reckoned_straight(3000, [](int i, double speed_mps) -> Felt {
    return {.forward_mps2 = i > 500 && speed_mps < 8.0 ? 1.0 : 0.0,
            .up_mps2 = 9.81 + kBias_mps2,
            .yaw_rate_radps = kBias_radps};
  });
  ASSERT_GT(reckoned.motion.back().T_world_imu.p.x(), 100.0);
  for (const evaluation::StampedPose& pose : reckoned.motion) {
    ASSERT_LT(std::abs(pose.T_world_imu.p.z()), 0.05) << TurningDrive::seconds(pose.time_ns);
    ASSERT_LT(std::abs(pose.T_world_imu.p.y()), 0.05) << TurningDrive::seconds(pose.time_ns);
  }
}

TEST(DeadReckon, TakesANodBeforeTheWheelsTurnForNoBias) {
  constexpr double kNod_radps = 0.02;
  constexpr int kNod = 30;  // samples
  const DeadReckoning reckoned = reckoned_straight(3000, [](int i, double speed_mps) -> Felt {
    return {.forward_mps2 = i > 500 && speed_mps < 8.0 ? 1.0 : 0.0,
            .pitch_rate_radps = i >= 500 - kNod && i < 500 ? kNod_radps : 0.0};
  });
  const Eigen::Matrix3d& R = reckoned.motion.back().T_world_imu.R;
  EXPECT_NEAR(std::asin(-R(2, 0)), 0.01 * kNod * kNod_radps, 0.001);
}

TEST(MotionStd, GrowsWithWayAndTime) {
  const OdometryNoise noise;
  const auto std = [&](double way_m, double seconds) {
    return motion_std({Eigen::Matrix3d::Identity(), {way_m, 0.0, 0.0}}, seconds, noise);
  };
  const Vector6 still = std(0.0, 0.0);
  EXPECT_LT((still.head<3>() - Eigen::Vector3d::Constant(noise.floor_rad)).norm(), 1e-12);
  EXPECT_LT((still.tail<3>() - Eigen::Vector3d::Constant(noise.floor_m)).norm(), 1e-12);
  for (int i = 0; i < 3; ++i) {
    EXPECT_GT(std(1.0, 2.0)(i), std(1.0, 1.0)(i));
    EXPECT_EQ(std(5.0, 1.0)(i), std(1.0, 1.0)(i));
    EXPECT_GT(std(2.0, 1.0)(3 + i), std(1.0, 1.0)(3 + i));
    EXPECT_EQ(std(1.0, 5.0)(3 + i), std(1.0, 1.0)(3 + i));
  }
  // Far and long, the roots of way and time count.
  EXPECT_NEAR(std(100.0, 1.0)(3), 10.0 * noise.along_m_per_root_m, 0.001);
  EXPECT_NEAR(std(100.0, 1.0)(4), 10.0 * noise.across_m_per_root_m, 0.001);
  EXPECT_NEAR(std(1.0, 400.0)(0), 20.0 * noise.rotation_rad_per_root_s, 1e-5);
}

TEST(MotionStd, TakesTimeRunningBackwardsForNone) {
  EXPECT_EQ(motion_std({}, -1.0, {}), motion_std({}, 0.0, {}));
}

}  // namespace
}  // namespace topoloc::refinement

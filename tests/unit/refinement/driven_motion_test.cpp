// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/driven_motion.hpp"

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

constexpr std::int64_t kPose_ns = 100'000'000;
constexpr int kPoses = 20;

/// Straight on along x at a speed; half-way the filter moves its position by `shift_m`.
evaluation::Trajectory driven(double speed_mps, const Eigen::Vector3d& shift_m) {
  evaluation::Trajectory filtered;
  std::vector<Eigen::Vector3d> v_imu_mps;
  std::vector<estimation::ImuSample> imu;
  for (int i = 0; i <= kPoses; ++i) {
    const std::int64_t time_ns = kPose_ns * i;
    Eigen::Vector3d p(0.1 * i * speed_mps, 0.0, 0.0);
    if (2 * i > kPoses) {
      p += shift_m;
    }
    filtered.push_back({time_ns, {Eigen::Matrix3d::Identity(), p}});
    v_imu_mps.emplace_back(speed_mps, 0.0, 0.0);
    imu.push_back({.time_ns = time_ns,
                   .specific_force_mps2 = {0.0, 0.0, 9.81},
                   .angular_rate_radps = Eigen::Vector3d::Zero()});
  }
  const GyroIntegral gyro(imu, Eigen::Vector3d::Zero());
  return driven_motion(filtered, v_imu_mps, Eigen::Vector3d::UnitX(), gyro);
}

TEST(DrivenMotion, TakesNoShiftSidewaysOrUpForAWay) {
  const evaluation::Trajectory motion = driven(10.0, {0.0, 0.7, -0.4});
  EXPECT_LT((motion.back().T_world_imu.p - Eigen::Vector3d(20.0, 0.0, 0.0)).norm(), 1e-9);
}

TEST(DrivenMotion, GoesForwardByTheFiltersSteps) {
  const evaluation::Trajectory motion = driven(10.0, {0.3, 0.0, 0.0});
  EXPECT_NEAR(motion.back().T_world_imu.p.x(), 20.3, 1e-9);
}

TEST(DrivenMotion, StandsWhereTheFilterShiftsAStandingVehicle) {
  const evaluation::Trajectory motion = driven(0.0, {0.5, 0.5, 0.0});
  EXPECT_LT(motion.back().T_world_imu.p.norm(), 1e-9);
}

}  // namespace
}  // namespace topoloc::refinement

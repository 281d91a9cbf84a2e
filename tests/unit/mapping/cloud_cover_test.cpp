// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/cloud_cover.hpp"

#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::mapping {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr PinholeCamera kCamera{160, 120, 110.0, 110.0, 79.5, 59.5};

/// What four poses on the x axis, 20 m apart and looking along z, see of a wall of 4 m.
CloudCover cover_of_wall_at(double x_m, double z_m) {
  PointCloud cloud;
  for (double x = x_m - 2.0; x <= x_m + 2.0; x += 0.5) {
    cloud.positions_m.emplace_back(Eigen::Vector3d(x, 0.5, z_m).cast<float>());
    cloud.intensities.push_back(1.0F);
  }
  std::vector<RigidTransform> poses;
  for (double x = 0.0; x <= 60.0; x += 20.0) {
    poses.push_back({Eigen::Matrix3d::Identity(), {x, 0.0, 0.0}});
  }
  RigidTransform T_imu_cam;
  T_imu_cam.p.x() = 1.0;
  constexpr double kSight_m = 60.0;
  return cloud_cover(CloudGrid(std::move(cloud)), kCamera, T_imu_cam, poses, kSight_m);
}

TEST(CloudCover, CountsThePosesThatSeeNothing) {
  // From 50 m away the image is 72 m wide; at 16 m, where the near wall's cell of 8 m ends, 23 m.
  EXPECT_EQ(cover_of_wall_at(30.0, 50.0).poses, 4U);
  EXPECT_EQ(cover_of_wall_at(30.0, 50.0).blind, 0U);
  EXPECT_EQ(cover_of_wall_at(0.0, 12.0).blind, 2U);
  EXPECT_EQ(cover_of_wall_at(30.0, -50.0).blind, 4U);  // behind
  EXPECT_EQ(cover_of_wall_at(30.0, 200.0).blind, 4U);  // out of sight
}

TEST(CloudCover, LiesElsewhereWhereMostPosesSeeNothing) {
  CloudCover cover;
  cover.poses = 4;
  cover.blind = 2;
  EXPECT_FALSE(cover.lies_elsewhere());
  cover.blind = 3;
  EXPECT_TRUE(cover.lies_elsewhere());
  EXPECT_TRUE(cover_of_wall_at(5000.0, 20.0).lies_elsewhere());
  EXPECT_FALSE(cover_of_wall_at(30.0, 50.0).lies_elsewhere());
}

TEST(CloudCover, ComplainsWithTheFiguresOfBothPlaces) {
  EXPECT_THAT(cover_of_wall_at(5000.0, 20.0).complaint(),
              AllOf(HasSubstr("elsewhere"), HasSubstr("4 of 4 poses"),
                    HasSubstr("Cloud: x 4998.0 to 5002.0"), HasSubstr("drive: x 0.0 to 60.0"),
                    HasSubstr("frame")));
}

}  // namespace
}  // namespace topoloc::mapping

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/cloud_check.hpp"

#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr PinholeCamera kCamera{160, 120, 110.0, 110.0, 79.5, 59.5};

/// What is said of a wall ahead of the camera, with these intensities; empty: nothing.
std::string complaint(double x_m, const std::function<float(int)>& intensity) {
  mapping::PointCloud cloud;
  for (int i = 0; i < 20; ++i) {
    cloud.positions_m.emplace_back(Eigen::Vector3d(x_m + 0.1 * i, 0.0, 10.0).cast<float>());
    cloud.intensities.push_back(intensity(i));
    cloud.has_intensity |= intensity(i) != 0.0F;
  }
  const std::vector<RigidTransform> poses(3);
  constexpr double kSight_m = 60.0;
  try {
    check_cloud(mapping::CloudGrid(std::move(cloud)), kCamera, {}, poses, kSight_m);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

float painted(int i) { return static_cast<float>(i % 3); }

TEST(CheckCloud, LetsAUsableCloudPass) { EXPECT_EQ(complaint(0.0, painted), ""); }

TEST(CheckCloud, RefusesACloudWithoutIntensities) {
  EXPECT_THAT(complaint(0.0, [](int) { return 0.0F; }),
              AllOf(HasSubstr("no intensities"), HasSubstr("--refine none")));
}

TEST(CheckCloud, RefusesACloudOfOneIntensity) {
  EXPECT_THAT(complaint(0.0, [](int) { return 100.0F; }),
              AllOf(HasSubstr("the same intensity, 100"), HasSubstr("--refine none")));
}

TEST(CheckCloud, RefusesACloudElsewhere) {
  EXPECT_THAT(complaint(500.0, painted), AllOf(HasSubstr("elsewhere"), HasSubstr("3 of 3 poses")));
}

}  // namespace
}  // namespace topoloc::refinement

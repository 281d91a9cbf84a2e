// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/window_registration.hpp"

#include "topoloc/evaluation/chi_square.hpp"
#include "topoloc/refinement/trajectory_refiner.hpp"

#include "unit/refinement/street_views.hpp"
#include "unit/refinement/textured_wall.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace topoloc::refinement {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Vector6 wrong_by(double roll_deg, double pitch_deg, double yaw_deg, double x, double y, double z) {
  Vector6 xi;
  xi << roll_deg * kDegree, pitch_deg * kDegree, yaw_deg * kDegree, x, y, z;
  return xi;
}

const Vector6 kWrong = wrong_by(0.2, -0.3, 0.6, 0.25, -0.2, 0.1);

/// A street, its cloud and views of it: made once, they take a while.
class WindowRegistration : public ::testing::Test {
 protected:
  static const mapping::CloudGrid& cloud() {
    static const mapping::CloudGrid grid = TexturedStreet(1).scan();
    return grid;
  }
  static const StreetViews& views() {
    static const StreetViews seen = look_at_street(cloud(), TexturedStreet(1), kWrong);
    return seen;
  }
  static const Registration& found() {
    static const Registration registration = views().registered();
    return registration;
  }
  /// What is still missing to the truth.
  static Vector6 error(const StreetViews& seen, const Registration& registration) {
    return motion_between(registration.T_world_imu, seen.truth[StreetViews::kMiddle]);
  }
  static void expect_found(const Vector6& off) {
    EXPECT_LT(off.head<3>().norm(), 0.15 * kDegree) << off.transpose();
    EXPECT_LT(off.tail<3>().norm(), 0.05) << off.transpose();
  }
};

TEST_F(WindowRegistration, FindsTheCommonMotionOfItsViews) {
  ASSERT_GT(views().correlations[StreetViews::kMiddle].patches.size(), 30U);
  expect_found(error(views(), found()));
}

TEST_F(WindowRegistration, FindsItAtHalfTheResolution) {
  const StreetViews half =
      look_at_street(cloud(), TexturedStreet(1), wrong_by(-0.3, 0.3, -0.8, -0.4, 0.3, -0.2), 2);
  const Vector6 off = error(half, half.registered());
  EXPECT_LT(off.head<3>().norm(), 0.25 * kDegree) << off.transpose();
  EXPECT_LT(off.tail<3>().norm(), 0.1) << off.transpose();
}

TEST_F(WindowRegistration, CoversItsErrorWithItsCovariance) {
  const Vector6 off = error(views(), found());
  EXPECT_LT(off.dot(found().covariance.inverse() * off),
            evaluation::chi_square_quantile(0.99, 6.0));
  // Nor is it so wide that it says nothing.
  EXPECT_LT(found().covariance.diagonal().tail<3>().maxCoeff(), 0.15 * 0.15);
  EXPECT_LT(found().covariance.diagonal().head<3>().maxCoeff(), kDegree * kDegree);
}

TEST_F(WindowRegistration, IsUncertainWhereTheSceneSaysNothing) {
  const TexturedStreet striped(1, true);
  const StreetViews seen =
      look_at_street(striped.scan(), striped, wrong_by(0.0, 0.0, 0.3, 0.0, 0.15, 0.05));
  SearchConfig config;
  config.floor_std.setZero();
  const Registration along_stripes = seen.registered(config);
  const Registration everywhere = views().registered(config);
  const auto std = [](const Registration& registration, int i) {
    return std::sqrt(registration.covariance(i, i));
  };
  EXPECT_GT(std(along_stripes, 3), 2.0 * std(along_stripes, 4));
  EXPECT_GT(std(along_stripes, 3), 1.5 * std(everywhere, 3));
  // Sideways it is found all the same.
  EXPECT_LT(std::abs(error(seen, along_stripes)(4)), 0.04);
}

TEST_F(WindowRegistration, IsNotSignificantForOtherTexture) {
  const double needed = RefinementConfig{}.min_significance;
  EXPECT_GT(found().significance, 1.5 * needed);
  for (const std::uint64_t seed : {100U, 200U}) {
    std::uint64_t image = seed;
    const StreetViews elsewhere = look_at_street(
        cloud(),
        [&](const RigidTransform&) {
          const PinholeCamera camera = TexturedStreet::camera();
          return patches({camera.width_px, camera.height_px}, image++);
        },
        kWrong);
    ASSERT_GT(elsewhere.correlations[0].patches.size(), 30U);
    const Registration registration = elsewhere.registered();
    EXPECT_LT(registration.significance, needed);
    EXPECT_LT(registration.score, 0.1 * found().score);
  }
}

TEST_F(WindowRegistration, AgreesLessWithTheSameStreetPaintedAnew) {
  // What remains is perspective: where walls are seen aslant all edges stand upright.
  const Registration repainted = look_at_street(cloud(), TexturedStreet(2), kWrong).registered();
  EXPECT_LT(repainted.significance, 0.8 * found().significance);
  EXPECT_LT(repainted.score, 0.3 * found().score);
}

/// What a sweep says of a street seen through a lens of this focal length (as share of the
/// camera's) and distortion, neither of which is known of.
BestLens best_lens_for(const mapping::CloudGrid& cloud, double focal, double radial) {
  const PinholeCamera camera = TexturedStreet::camera();
  cv::Mat from(camera.height_px, camera.width_px, CV_32FC2);
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u) {
      const Eigen::Vector3d ray = camera.ray({u, v}) / focal;
      const double share = (1.0 - radial * ray.head<2>().squaredNorm()) / focal;  // first order
      from.at<cv::Vec2f>(v, u) = cv::Vec2d(camera.cx_px + share * (u - camera.cx_px),
                                           camera.cy_px + share * (v - camera.cy_px));
    }
  }
  const TexturedStreet street(1);
  const StreetViews seen = look_at_street(
      cloud,
      [&](const RigidTransform& T_world_cam) {
        cv::Mat photo;
        cv::remap(street.photo(T_world_cam), photo, from, cv::noArray(), cv::INTER_LINEAR,
                  cv::BORDER_REFLECT);
        return photo;
      },
      kWrong);
  return best_lens(sweep_lens(seen.window(), seen.start[StreetViews::kMiddle],
                              seen.registered().T_world_imu, TexturedStreet::T_imu_cam(), camera,
                              {}));
}

TEST_F(WindowRegistration, FindsNoFaultWithTheRightLens) {
  const BestLens found = best_lens_for(cloud(), 1.0, 0.0);
  EXPECT_EQ(found.change.focal, 1.0);
  EXPECT_EQ(found.change.radial, 0.0);
  EXPECT_EQ(found.gain, 1.0);
  EXPECT_EQ(found.significance, 0.0);
}

TEST_F(WindowRegistration, TellsAWrongFocalLength) {
  for (const double focal : {0.95, 0.97, 1.03, 1.05}) {
    const BestLens found = best_lens_for(cloud(), focal, 0.0);
    EXPECT_NEAR(found.change.focal, focal, 0.02);
    EXPECT_GT(found.gain, 1.0);
    EXPECT_GT(found.significance, RefinementConfig{}.max_lens_significance);
  }
}

TEST_F(WindowRegistration, TellsADistortionThatWasNotTakenOut) {
  for (const double radial : {-0.15, 0.15}) {
    const BestLens found = best_lens_for(cloud(), 1.0, radial);
    EXPECT_GT(found.change.radial * radial, 0.0);
    EXPECT_GT(found.significance, RefinementConfig{}.max_lens_significance);
  }
}

TEST_F(WindowRegistration, ASweepWithoutAgreementSaysNothingOfTheLens) {
  EXPECT_EQ(best_lens({}).significance, 0.0);
  LensSweep sweep{};
  sweep[1] = {.agreement = 0.1, .scatter = 1e-6};
  EXPECT_EQ(best_lens(sweep).significance, 0.0);
}

TEST_F(WindowRegistration, DoesNotHangOnTheNumberOfThreads) {
  SearchConfig config;
  config.threads = 3;
  const Registration other = views().registered(config);
  EXPECT_EQ(other.T_world_imu.p, found().T_world_imu.p);
  EXPECT_EQ(other.T_world_imu.R, found().T_world_imu.R);
  EXPECT_EQ(other.covariance, found().covariance);
}

TEST_F(WindowRegistration, GivesTheSameBitsTwice) {
  const Registration again = views().registered();
  EXPECT_EQ(again.T_world_imu.R, found().T_world_imu.R);
  EXPECT_EQ(again.T_world_imu.p, found().T_world_imu.p);
  EXPECT_EQ(again.covariance, found().covariance);
  EXPECT_EQ(again.score, found().score);
  EXPECT_EQ(again.significance, found().significance);
}

TEST_F(WindowRegistration, DoesNotHangOnTheSamplesDrawn) {
  SearchConfig config;
  config.seed = 77;
  expect_found(error(views(), views().registered(config)));
}

TEST_F(WindowRegistration, KnowsNoMoreThanTheStartWithoutPatches) {
  StreetViews blind = views();
  for (ViewCorrelation& correlation : blind.correlations) {
    correlation.patches.clear();
  }
  const SearchConfig config;
  const Registration registration = blind.registered(config);
  EXPECT_EQ(registration.significance, 0.0);
  const Vector6 moved_by =
      motion_between(blind.start[StreetViews::kMiddle], registration.T_world_imu);
  EXPECT_LT(moved_by.cwiseQuotient(config.std).norm(), 0.1);
  const Vector6 variance = config.std.cwiseAbs2() + config.floor_std.cwiseAbs2();
  EXPECT_LT((registration.covariance.diagonal() - variance).cwiseQuotient(variance).norm(), 1e-6);
}

}  // namespace
}  // namespace topoloc::refinement

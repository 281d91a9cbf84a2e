// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/match_registration.hpp"

#include "topoloc/evaluation/chi_square.hpp"
#include "topoloc/refinement/trajectory_refiner.hpp"

#include "refinement/matcher_image.hpp"
#include "unit/refinement/template_matcher.hpp"
#include "unit/refinement/textured_wall.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

constexpr double kMatchDegree = std::numbers::pi / 180.0;
const double kSignificant = RefinementConfig{}.min_significance;

/// A street, its cloud and one view of it from a pose that is wrong.
class MatchRegistration : public ::testing::Test {
 protected:
  static const mapping::CloudGrid& cloud() {
    static const mapping::CloudGrid grid = TexturedStreet(1).scan();
    return grid;
  }
  static Vector6 prior_std() {
    return (Vector6() << 0.008, 0.008, 0.0175, 0.3, 0.3, 0.3).finished();
  }
  static RigidTransform truth(double x_m) { return TexturedStreet::vehicle_at(x_m); }
  /// What the vehicle's camera sees in a street.
  static cv::Mat photo(const TexturedStreet& street, double x_m) {
    return street.photo(truth(x_m) * TexturedStreet::T_imu_cam());
  }
  /// Registers a camera image whose prior is off by `wrong`.
  static Registration registered(const cv::Mat& image, double x_m, const Vector6& wrong) {
    const PosePrior prior{moved(truth(x_m), wrong), prior_std()};
    const RigidTransform T_imu_cam = TexturedStreet::T_imu_cam();
    const mapping::RenderedView view =
        mapping::render(cloud(), TexturedStreet::camera(), prior.T_world_imu * T_imu_cam);
    std::vector<matching::PixelMatch> matches;
    TemplateMatcher().match(matcher_image(view), {image, {}}, matches);
    EXPECT_GT(matches.size(), 0U);
    return register_by_matches(matches, view, prior, T_imu_cam);
  }
  static const Registration& found() {
    static const Registration registration = registered(photo(TexturedStreet(1), 2.0), 2.0, kWrong);
    return registration;
  }
  static Vector6 error(const Registration& registration, double x_m) {
    return motion_between(registration.T_world_imu, truth(x_m));
  }

  static const Vector6 kWrong;
};

const Vector6 MatchRegistration::kWrong =
    (Vector6() << 0.006, -0.007, 0.015, 0.25, -0.2, 0.15).finished();

TEST_F(MatchRegistration, FindsThePoseOfAView) {
  EXPECT_EQ(found().route, Route::kMatches);
  EXPECT_GT(found().significance, kSignificant);
  EXPECT_GT(found().score, 0.5);
  const Vector6 off = error(found(), 2.0);
  EXPECT_LT(off.head<3>().norm(), 0.4 * kMatchDegree) << off.transpose();
  EXPECT_LT(off.tail<3>().norm(), 0.12) << off.transpose();
}

TEST_F(MatchRegistration, CoversItsErrorsWithItsCovariance) {
  test::Random random(1);
  double sum = 0.0;
  constexpr int kViews = 8;
  for (int i = 0; i < kViews; ++i) {
    const double x_m = 1.5 * i;
    const Vector6 wrong = 0.7 * prior_std().cwiseProduct(random.normal_vector<6>());
    const Registration registration = registered(photo(TexturedStreet(1), x_m), x_m, wrong);
    EXPECT_GT(registration.significance, kSignificant) << x_m;
    const Vector6 off = error(registration, x_m);
    sum += off.dot(registration.covariance.inverse() * off);
    EXPECT_LT(registration.covariance.diagonal().tail<3>().maxCoeff(), 0.2 * 0.2);
  }
  EXPECT_LT(sum, evaluation::chi_square_quantile(0.99, 6.0 * kViews));
}

TEST_F(MatchRegistration, IsNotSignificantForAnotherPlace) {
  for (const std::uint64_t seed : {2U, 3U, 4U}) {
    EXPECT_LT(registered(photo(TexturedStreet(seed), 2.0), 2.0, kWrong).significance, kSignificant)
        << seed;
  }
  // The same street, 12 m on.
  EXPECT_LT(registered(photo(TexturedStreet(1), 14.0), 2.0, kWrong).significance, kSignificant);
}

TEST_F(MatchRegistration, IsNotSignificantForOtherTexture) {
  const PinholeCamera camera = TexturedStreet::camera();
  for (const std::uint64_t seed : {5U, 6U, 7U}) {
    const cv::Mat image = patches({camera.width_px, camera.height_px}, seed);
    EXPECT_LT(registered(image, 2.0, kWrong).significance, kSignificant) << seed;
  }
}

TEST_F(MatchRegistration, IsNotSignificantForMatchesAnywhere) {
  const PosePrior prior{truth(2.0), prior_std()};
  const RigidTransform T_imu_cam = TexturedStreet::T_imu_cam();
  const PinholeCamera camera = TexturedStreet::camera();
  const mapping::RenderedView view =
      mapping::render(cloud(), camera, prior.T_world_imu * T_imu_cam);
  test::Random random(9);
  const auto pixel = [](double u, double v) {
    return Eigen::Vector2f(static_cast<float>(u), static_cast<float>(v));
  };
  constexpr double kReach_px = 40.0;  // what the prior allows to most points, and more
  for (const int count : {20, 100, 400}) {
    for (int trial = 0; trial < 10; ++trial) {
      std::vector<matching::PixelMatch> matches;
      for (int i = 0; i < count; ++i) {
        const double u = random.uniform(0.0, camera.width_px - 1.0);
        const double v = random.uniform(0.0, camera.height_px - 1.0);
        matches.push_back({pixel(u, v),
                           pixel(u + random.uniform(-kReach_px, kReach_px),
                                 v + random.uniform(-kReach_px, kReach_px)),
                           0.5F});
      }
      EXPECT_LT(register_by_matches(matches, view, prior, T_imu_cam).significance, kSignificant)
          << count;
    }
  }
}

void expect_the_prior(const Registration& registration, const PosePrior& prior) {
  EXPECT_EQ(registration.significance, 0.0);
  EXPECT_EQ(registration.score, 0.0);
  EXPECT_EQ(registration.T_world_imu.p, prior.T_world_imu.p);
  EXPECT_EQ(registration.covariance.diagonal(), prior.std.cwiseAbs2());
}

TEST_F(MatchRegistration, KnowsNoMoreThanThePriorWithoutMatches) {
  const PosePrior prior{truth(2.0), prior_std()};
  const RigidTransform T_imu_cam = TexturedStreet::T_imu_cam();
  const mapping::RenderedView view =
      mapping::render(cloud(), TexturedStreet::camera(), prior.T_world_imu * T_imu_cam);
  expect_the_prior(register_by_matches({}, view, prior, T_imu_cam), prior);
}

TEST_F(MatchRegistration, KnowsNoMoreThanThePriorWhereTheCloudHasHoles) {
  const PosePrior prior{truth(2.0), prior_std()};
  const cv::Mat image = photo(TexturedStreet(1), 2.0);
  const mapping::RenderedView holes =
      wall_view(image, cv::Mat(image.size(), CV_8UC1, cv::Scalar(0)));
  const matching::MaskedImage nothing = matcher_image(holes);
  EXPECT_EQ(cv::countNonZero(nothing.mask), 0);
  std::vector<matching::PixelMatch> matches;
  TemplateMatcher().match({image, {}}, {image, {}}, matches);
  ASSERT_GT(matches.size(), 20U);
  expect_the_prior(register_by_matches(matches, holes, prior, TexturedStreet::T_imu_cam()), prior);
}

TEST_F(MatchRegistration, GivesTheSameBitsTwice) {
  const Registration again = registered(photo(TexturedStreet(1), 2.0), 2.0, kWrong);
  EXPECT_EQ(again.T_world_imu.R, found().T_world_imu.R);
  EXPECT_EQ(again.T_world_imu.p, found().T_world_imu.p);
  EXPECT_EQ(again.covariance, found().covariance);
  EXPECT_EQ(again.significance, found().significance);
}

TEST(MatcherImage, FillsSmallHolesAndMasksLargeOnes) {
  const cv::Size size(120, 80);
  const cv::Mat paint = patches(size, 1);
  cv::Mat seen = scattered(size, 0.4, 2);
  seen(cv::Rect(0, 0, 40, 80)).setTo(0);
  const matching::MaskedImage image = matcher_image(wall_view(paint, seen));
  EXPECT_EQ(image.grey.size(), size);
  EXPECT_EQ(cv::countNonZero(image.mask(cv::Rect(0, 0, 30, 80))), 0);
  EXPECT_GT(cv::countNonZero(image.mask(cv::Rect(50, 0, 70, 80))), 0.97 * 70 * 80);
  EXPECT_EQ(image.grey.at<unsigned char>(40, 10), 128);
}

TEST(MatcherImage, DoesNotDependOnTheUnit) {
  const cv::Size size(120, 80);
  const cv::Mat paint = patches(size, 1);
  const matching::MaskedImage one = matcher_image(wall_view(paint, everywhere(size)));
  const matching::MaskedImage other = matcher_image(wall_view(paint, everywhere(size), 256.0F));
  EXPECT_EQ(cv::norm(one.grey, other.grey, cv::NORM_INF), 0.0);
  double darkest = 0.0;
  double brightest = 0.0;
  cv::minMaxLoc(one.grey, &darkest, &brightest);
  EXPECT_EQ(darkest, 0.0);
  EXPECT_EQ(brightest, 255.0);
}

}  // namespace
}  // namespace topoloc::refinement

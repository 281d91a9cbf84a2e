// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/gradient_field.hpp"

#include "unit/refinement/textured_wall.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

const cv::Size kFieldSize(160, 120);
const cv::Rect kInner(20, 20, 120, 80);

/// Root mean square length of the field's vectors.
double strength(const cv::Mat& orientation) {
  return cv::norm(orientation) / std::sqrt(static_cast<double>(orientation.total()));
}

double largest_difference(const GradientField& a, const GradientField& b) {
  return cv::norm(a.orientation, b.orientation, cv::NORM_INF);
}

/// Cosine between two fields: 1 if they agree.
double likeness(const cv::Mat& a, const cv::Mat& b) {
  return a.dot(b) / (cv::norm(a) * cv::norm(b));
}

/// Bright beyond the line through the middle whose normal points in that direction.
cv::Mat edge(double normal_rad) {
  cv::Mat image(kFieldSize, CV_8UC1);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const double off = (u - 80) * std::cos(normal_rad) + (v - 60) * std::sin(normal_rad);
      image.at<unsigned char>(v, u) =
          static_cast<unsigned char>(125.0 + 75.0 * std::clamp(off, -1.0, 1.0));
    }
  }
  return image;
}

TEST(GradientField, PointsAlongTheDoubleAngle) {
  constexpr double kPi = 3.14159265358979323846;
  for (const double degrees : {0.0, 30.0, 90.0, 135.0, 200.0, 270.0}) {
    const double angle = degrees * kPi / 180.0;
    const GradientField field =
        camera_gradients(edge(angle), everywhere(kFieldSize), GradientConfig{});
    const auto at_edge = field.orientation.at<cv::Vec2f>(60, 80);
    const double length = std::hypot(at_edge[0], at_edge[1]);
    EXPECT_GT(length, 0.5) << degrees;
    EXPECT_LE(length, 1.0) << degrees;
    EXPECT_NEAR(at_edge[0] / length, std::cos(2.0 * angle), 0.03) << degrees;
    EXPECT_NEAR(at_edge[1] / length, std::sin(2.0 * angle), 0.03) << degrees;
  }
}

TEST(GradientField, ForgetsTheSignOfContrast) {
  const cv::Mat image = patches(kFieldSize, 1);
  const cv::Mat mask = everywhere(kFieldSize);
  const GradientField field = camera_gradients(image, mask, GradientConfig{});
  const GradientField inverted = camera_gradients(255 - image, mask, GradientConfig{});
  ASSERT_GT(strength(field.orientation), 0.2);
  EXPECT_LT(largest_difference(field, inverted), 1e-3);
}

TEST(GradientField, IsZeroWhereTheMaskIs) {
  const cv::Mat image = patches(kFieldSize, 2);
  cv::Mat mask = everywhere(kFieldSize);
  const cv::Rect bonnet(40, 60, 80, 60);
  mask(bonnet).setTo(0);
  // Gradients are taken of smoothed brightness: what is beyond the mask's border must not leak.
  const GradientField field = camera_gradients(image, mask, GradientConfig{});
  EXPECT_EQ(cv::norm(field.orientation(bonnet), cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::countNonZero(field.valid(bonnet)), 0);
  EXPECT_EQ(cv::norm(field.orientation(bonnet + cv::Point(0, -3)), cv::NORM_INF), 0.0);
  EXPECT_GT(strength(field.orientation(cv::Rect(10, 10, 140, 40))), 0.2);
}

TEST(GradientField, OfAnEvenImageIsNothing) {
  const cv::Mat grey(kFieldSize, CV_8UC1, cv::Scalar(90));
  const GradientField field = camera_gradients(grey, everywhere(kFieldSize), GradientConfig{});
  EXPECT_LT(cv::norm(field.orientation, cv::NORM_INF), 1e-3);
}

TEST(GradientField, DoesNotDependOnTheUnitOfIntensity) {
  const cv::Mat intensity = patches(kFieldSize, 3);
  const cv::Mat seen = scattered(kFieldSize, 0.6, 30);
  const GradientField field = intensity_gradients(wall_view(intensity, seen), GradientConfig{});
  const GradientField scaled =
      intensity_gradients(wall_view(intensity, seen, 1000.0F), GradientConfig{});
  ASSERT_GT(strength(field.orientation), 0.2);
  EXPECT_LT(largest_difference(field, scaled), 1e-3);
}

TEST(GradientField, HolesAloneAreNoEdges) {
  const cv::Mat even(kFieldSize, CV_8UC1, cv::Scalar(90));
  const GradientField field =
      intensity_gradients(wall_view(even, scattered(kFieldSize, 0.4, 31)), GradientConfig{});
  ASSERT_EQ(cv::countNonZero(field.valid(kInner)), kInner.area());
  EXPECT_LT(cv::norm(field.orientation, cv::NORM_INF), 0.02);
}

TEST(GradientField, OfASparseCloudIsThatOfADenseOne) {
  const cv::Mat intensity = patches(kFieldSize, 4);
  const GradientField dense =
      intensity_gradients(wall_view(intensity, everywhere(kFieldSize)), GradientConfig{});
  const GradientField sparse =
      intensity_gradients(wall_view(intensity, scattered(kFieldSize, 0.4, 32)), GradientConfig{});
  EXPECT_GT(likeness(dense.orientation(kInner), sparse.orientation(kInner)), 0.8);
}

TEST(GradientField, OfCameraAndIntensityAgree) {
  const cv::Mat paint = patches(kFieldSize, 5);
  const GradientField camera =
      camera_gradients(255 - paint, everywhere(kFieldSize), GradientConfig{});
  const GradientField intensity =
      intensity_gradients(wall_view(paint, everywhere(kFieldSize)), GradientConfig{});
  const GradientField other =
      camera_gradients(patches(kFieldSize, 6), everywhere(kFieldSize), GradientConfig{});
  EXPECT_GT(likeness(camera.orientation(kInner), intensity.orientation(kInner)), 0.8);
  EXPECT_LT(likeness(other.orientation(kInner), intensity.orientation(kInner)), 0.3);
}

TEST(GradientField, IsUnknownWhereTheCloudHasNoPoints) {
  cv::Mat seen = everywhere(kFieldSize);
  const cv::Rect sky(0, 0, 160, 60);
  seen(sky).setTo(0);
  const GradientField field =
      intensity_gradients(wall_view(patches(kFieldSize, 7), seen), GradientConfig{});
  const cv::Rect inside(0, 0, 160, 55);
  EXPECT_EQ(cv::countNonZero(field.valid(inside)), 0);
  EXPECT_EQ(cv::norm(field.orientation(inside), cv::NORM_INF), 0.0);
  EXPECT_GT(strength(field.orientation(cv::Rect(10, 75, 140, 35))), 0.2);
}

TEST(GradientField, OfNoCloudAtAllIsUnknown) {
  const cv::Mat none = cv::Mat::zeros(kFieldSize, CV_8UC1);
  const GradientField field = intensity_gradients(wall_view(none, none), GradientConfig{});
  EXPECT_EQ(cv::countNonZero(field.valid), 0);
  EXPECT_EQ(cv::norm(field.orientation, cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace topoloc::refinement

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/undistorter.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace topoloc::matching {
namespace {

CameraCalibration lens(Distortion distortion, std::array<double, 5> coefficients) {
  return {.pinhole = {.width_px = 800,
                      .height_px = 600,
                      .fx_px = 400,
                      .fy_px = 402,
                      .cx_px = 396.2,
                      .cy_px = 305.1},
          .distortion = distortion,
          .coefficients = coefficients};
}

/// A picture whose grey value is a smooth function of the ray that each raw pixel sees.
cv::Mat picture_of_rays(const CameraCalibration& camera) {
  cv::Mat image(camera.pinhole.height_px, camera.pinhole.width_px, CV_8UC1, cv::Scalar(0));
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      if (const auto ray = camera.unproject({u, v})) {
        image.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(
            std::lround(128 + 60 * std::sin(5 * ray->x()) + 60 * std::sin(4 * ray->y())));
      }
    }
  }
  return image;
}

void expect_straight(const CameraCalibration& raw, const PinholeCamera& target) {
  const Undistorter undistorter(raw, target);
  cv::Mat out;
  undistorter.undistort(picture_of_rays(raw), out);
  const cv::Mat mask = undistorter.mask({}, 2);
  int usable = 0;
  for (int v = 0; v < out.rows; ++v) {
    for (int u = 0; u < out.cols; ++u) {
      if (mask.at<std::uint8_t>(v, u) != 0) {
        ++usable;
        const Eigen::Vector3d ray = target.ray({u, v});
        ASSERT_NEAR(out.at<std::uint8_t>(v, u),
                    128 + 60 * std::sin(5 * ray.x()) + 60 * std::sin(4 * ray.y()), 3.0)
            << u << " " << v;
      }
    }
  }
  EXPECT_GT(usable, out.rows * out.cols / 2);
}

constexpr PinholeCamera kTarget{
    .width_px = 320, .height_px = 192, .fx_px = 225, .fy_px = 225, .cx_px = 159.5, .cy_px = 95.5};
constexpr PinholeCamera kCoarse{
    .width_px = 160, .height_px = 96, .fx_px = 110, .fy_px = 110, .cx_px = 79.5, .cy_px = 47.5};

TEST(Undistorter, EveryTargetPixelShowsItsOwnRay) {
  for (const PinholeCamera& target : {kTarget, kCoarse}) {  // coarse: averaged down first
    expect_straight(lens(Distortion::kNone, {}), target);
    expect_straight(lens(Distortion::kRadTan, {-0.3, 0.1, 1e-3, -5e-4, 0.0}), target);
    expect_straight(lens(Distortion::kEquidistant, {-0.02, 0.003, -0.001, 0.0, 0.0}), target);
  }
}

TEST(Undistorter, MasksWhatTheRawImageDoesNotShowAndTheBonnetWithAMargin) {
  CameraCalibration narrow = lens(Distortion::kNone, {});
  narrow.pinhole.fx_px = narrow.pinhole.fy_px = 1000.0;  // sees +-0.4, the target +-0.7
  const Undistorter undistorter(narrow, kTarget);
  cv::Mat bonnet(600, 800, CV_8UC1, cv::Scalar(255));
  bonnet.rowRange(400, 600) = 0;
  const cv::Mat mask = undistorter.mask(bonnet, 3);
  EXPECT_EQ(mask.at<std::uint8_t>(96, 2), 0);
  EXPECT_EQ(mask.at<std::uint8_t>(96, 160), 255);
  // Raw row 400 is ray (400 - 305.1) / 1000, target row 95.5 + 225 * 0.0949 = 116.9.
  EXPECT_EQ(mask.at<std::uint8_t>(116, 160), 0);
  EXPECT_EQ(mask.at<std::uint8_t>(112, 160), 255);
  EXPECT_EQ(undistorter.mask(bonnet, 0).at<std::uint8_t>(115, 160), 255);
}

TEST(Undistorter, RefusesImagesOfAnotherSizeOrType) {
  const Undistorter undistorter(lens(Distortion::kNone, {}), kTarget);
  cv::Mat out;
  EXPECT_THROW(undistorter.undistort(cv::Mat(600, 801, CV_8UC1), out), std::invalid_argument);
  EXPECT_THROW(undistorter.undistort(cv::Mat(600, 800, CV_8UC3), out), std::invalid_argument);
  EXPECT_THROW(undistorter.undistort({}, out), std::invalid_argument);
  EXPECT_THROW(Undistorter(lens(Distortion::kNone, {}), {}), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::matching

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/geometry/camera.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace topoloc {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr PinholeCamera kPinhole{.width_px = 752,
                                 .height_px = 480,
                                 .fx_px = 458.654,
                                 .fy_px = 457.296,
                                 .cx_px = 367.215,
                                 .cy_px = 248.375};
// The EuRoC data set's camera, with a k3 added so that its place is tested too.
const CameraCalibration kRadTan{
    .pinhole = kPinhole,
    .distortion = Distortion::kRadTan,
    .coefficients = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.01}};
const CameraCalibration kEquidistant{.pinhole = kPinhole,
                                     .distortion = Distortion::kEquidistant,
                                     .coefficients = {-0.013, 0.02, -0.01, 0.0015}};
const CameraCalibration kIdeal{.pinhole = kPinhole};

const Vector3d kPoints[] = {{0.3, -0.2, 1.0}, {-2.0, 1.0, 4.0}, {0.0, 0.0, 2.0}, {1.5, 0.9, 3.0}};

TEST(PinholeCamera, ProjectsByHand) {
  EXPECT_LT(
      (kPinhole.project({0.5, -0.25, 2.0}) - Vector2d(367.215 + 458.654 / 4, 248.375 - 457.296 / 8))
          .norm(),
      1e-12);
}

TEST(PinholeCamera, RayUndoesProject) {
  const Vector3d q(0.5, -0.25, 2.0);
  EXPECT_LT((kPinhole.ray(kPinhole.project(q)) * q.z() - q).norm(), 1e-14);
}

TEST(PinholeCamera, ContainsItsPixelCentres) {
  EXPECT_TRUE(kPinhole.contains({0.0, 0.0}));
  EXPECT_TRUE(kPinhole.contains({751.0, 479.0}));
  EXPECT_FALSE(kPinhole.contains({751.01, 479.0}));
  EXPECT_FALSE(kPinhole.contains({0.0, -0.01}));
  EXPECT_FALSE(kPinhole.contains({3.0, 200.0}, 4.0));
  EXPECT_FALSE(kPinhole.contains({std::numeric_limits<double>::quiet_NaN(), 1.0}));
}

// Reference values: cv::projectPoints and cv::fisheye::projectPoints of OpenCV 4.6.
TEST(CameraCalibration, RadTanAgreesWithOpenCv) {
  const Vector2d expected[] = {{499.9085915278, 160.1867353315},
                               {156.4564073476, 353.4712092253},
                               {367.215, 248.375},
                               {576.5285649501, 373.6197487644}};
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT((kRadTan.project(kPoints[i]) - expected[i]).norm(), 1e-9) << i;
  }
}

TEST(CameraCalibration, EquidistantAgreesWithOpenCv) {
  const Vector2d expected[] = {{499.1046014983, 160.7089347936},
                               {158.5624040798, 352.3924047364},
                               {367.215, 248.375},
                               {574.3601276277, 372.2940827294}};
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT((kEquidistant.project(kPoints[i]) - expected[i]).norm(), 1e-9) << i;
  }
}

TEST(CameraCalibration, UnprojectUndoesProjectOverTheWholeImage) {
  for (const CameraCalibration& camera : {kIdeal, kRadTan, kEquidistant}) {
    for (int u = 0; u < kPinhole.width_px; u += 25) {
      for (int v = 0; v < kPinhole.height_px; v += 25) {
        const auto ray = camera.unproject({u, v});
        ASSERT_TRUE(ray) << u << ' ' << v;
        EXPECT_DOUBLE_EQ(ray->z(), 1.0);
        EXPECT_LT((camera.project(*ray) - Vector2d(u, v)).norm(), 1e-6) << u << ' ' << v;
      }
    }
  }
}

TEST(CameraCalibration, UnprojectFindsTheRayItCameFrom) {
  for (const CameraCalibration& camera : {kIdeal, kRadTan, kEquidistant}) {
    for (const Vector3d& q : kPoints) {
      const auto ray = camera.unproject(camera.project(q));
      ASSERT_TRUE(ray);
      EXPECT_LT((*ray - q / q.z()).norm(), 1e-8);
    }
  }
}

// Barrel distortion r (1 - 0.3 r^2) reaches at most 0.70 at r = 1.05. Beyond it the polynomial has
// a root on the opposite side of the image, which must not be taken for the ray.
TEST(CameraCalibration, UnprojectFailsOutsideTheRangeOfRadTan) {
  CameraCalibration barrel{.pinhole = kPinhole, .distortion = Distortion::kRadTan};
  barrel.coefficients = {-0.3, 0.0, 0.0, 0.0, 0.0};
  for (double r = 0.75; r < 6.0; r += 0.05) {
    for (const Vector2d& direction : {Vector2d(1.0, 0.0), Vector2d(0.6, -0.8)}) {
      const Vector2d pixel(kPinhole.fx_px * r * direction.x() + kPinhole.cx_px,
                           kPinhole.fy_px * r * direction.y() + kPinhole.cy_px);
      EXPECT_FALSE(barrel.unproject(pixel)) << r;
    }
  }
}

// With k2 > 0 the polynomial rises again behind the fold: that branch is not the lens either.
TEST(CameraCalibration, UnprojectDoesNotJumpOverAFold) {
  CameraCalibration folded{.pinhole = kPinhole, .distortion = Distortion::kRadTan};
  folded.coefficients = {-0.5, 0.08, 0.0, 0.0, 0.0};
  for (double r = 0.62; r < 6.0; r += 0.05) {  // the fold lies at r_d = 0.60
    EXPECT_FALSE(folded.unproject({kPinhole.fx_px * r + kPinhole.cx_px, kPinhole.cy_px})) << r;
  }
}

TEST(CameraCalibration, UnprojectFailsBeyondNinetyDegreesOfEquidistant) {
  CameraCalibration fisheye{.pinhole = kPinhole, .distortion = Distortion::kEquidistant};
  EXPECT_TRUE(fisheye.unproject({kPinhole.fx_px * 1.5 + kPinhole.cx_px, kPinhole.cy_px}));
  for (const double theta : {1.58, 2.0, 3.0, 10.0}) {
    EXPECT_FALSE(fisheye.unproject({kPinhole.fx_px * theta + kPinhole.cx_px, kPinhole.cy_px}));
  }
}

TEST(CameraCalibration, UnprojectRefusesNaN) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const CameraCalibration& camera : {kIdeal, kRadTan, kEquidistant}) {
    EXPECT_FALSE(camera.unproject({nan, 10.0}));
  }
}

}  // namespace
}  // namespace topoloc

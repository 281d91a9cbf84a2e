// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/view_correlation.hpp"

#include "unit/refinement/textured_wall.hpp"

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

const cv::Size kWallSize(320, 240);
constexpr float kWallDepth_m = 10.0F;

/// The image's content moved by (du, dv) to the right and down; brightness at the edge repeated.
cv::Mat shifted(const cv::Mat& image, double du, double dv) {
  const cv::Mat M = (cv::Mat_<double>(2, 3) << 1, 0, du, 0, 1, dv);
  cv::Mat out;
  cv::warpAffine(image, out, M, image.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return out;
}

/// The wall as LiDAR sees it from the identity pose, against any image.
struct Wall {
  cv::Mat paint = patches(kWallSize, 11);
  mapping::RenderedView view = wall_view(paint, scattered(kWallSize, 0.6, 12), 1.0F, kWallDepth_m);

  [[nodiscard]] ViewCorrelation against(const cv::Mat& image, int shrink,
                                        const cv::Mat& mask = everywhere(kWallSize)) const {
    return correlate(camera_gradients(image, mask, {}), intensity_gradients(view, {}), view, {},
                     shrink, {});
  }
};

cv::Mat summed(const ViewCorrelation& correlation, std::size_t level) {
  const int side = 2 * correlation.range + 1;
  cv::Mat sum = cv::Mat::zeros(side, side, CV_32F);
  for (const CorrelationPatch& patch : correlation.patches) {
    sum += patch.surfaces[level];
  }
  return sum;
}

struct ShiftCase {
  int shrink;
  bool inverted;
};

class ViewCorrelationShift : public ::testing::TestWithParam<ShiftCase> {};

TEST_P(ViewCorrelationShift, PeaksWhereTheImageIsShiftedTo) {
  const Wall wall;
  for (const Eigen::Vector2i& shift : {Eigen::Vector2i(12, -8), Eigen::Vector2i(-20, 6)}) {
    cv::Mat image = shifted(wall.paint, shift.x(), shift.y());
    if (GetParam().inverted) {
      image = 255 - image;
    }
    const ViewCorrelation correlation = wall.against(image, GetParam().shrink);
    ASSERT_EQ(correlation.shrink, GetParam().shrink);
    ASSERT_GT(correlation.patches.size(), 20U);
    for (std::size_t level = 0; level < 3; ++level) {
      cv::Point peak;
      cv::minMaxLoc(summed(correlation, level), nullptr, nullptr, nullptr, &peak);
      EXPECT_NEAR((peak.x - correlation.range) * correlation.shrink, shift.x(), correlation.shrink)
          << level;
      EXPECT_NEAR((peak.y - correlation.range) * correlation.shrink, shift.y(), correlation.shrink)
          << level;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Resolutions, ViewCorrelationShift,
                         ::testing::Values(ShiftCase{1, false}, ShiftCase{1, true},
                                           ShiftCase{2, false}, ShiftCase{2, true}));

TEST(ViewCorrelation, KnowsWhatEachPatchShows) {
  const Wall wall;
  const ViewCorrelation correlation = wall.against(wall.paint, 1);
  ASSERT_FALSE(correlation.patches.empty());
  for (const CorrelationPatch& patch : correlation.patches) {
    EXPECT_NEAR(patch.q_world.z(), kWallDepth_m, 1e-4);
    EXPECT_LT((wall.view.camera.project(patch.q_world) - patch.pixel_px).norm(), 1e-4);
    for (const cv::Mat& surface : patch.surfaces) {
      EXPECT_EQ(surface.size(), cv::Size(61, 61));
    }
  }
}

TEST(ViewCorrelation, HasNoPatchesWithoutTexture) {
  const Wall wall;
  const cv::Mat even(kWallSize, CV_8UC1, cv::Scalar(100));
  EXPECT_TRUE(wall.against(even, 1).patches.empty());
  const Wall plain{.paint = even, .view = wall_view(even, everywhere(kWallSize))};
  EXPECT_TRUE(plain.against(wall.paint, 1).patches.empty());
}

TEST(ViewCorrelation, HasNoPatchesWhereTheImageIsMasked) {
  const Wall wall;
  EXPECT_TRUE(wall.against(wall.paint, 1, cv::Mat::zeros(kWallSize, CV_8UC1)).patches.empty());
  cv::Mat left_half = everywhere(kWallSize);
  left_half(cv::Rect(160, 0, 160, 240)).setTo(0);
  const ViewCorrelation correlation = wall.against(wall.paint, 1, left_half);
  ASSERT_FALSE(correlation.patches.empty());
  for (const CorrelationPatch& patch : correlation.patches) {
    EXPECT_LT(patch.pixel_px.x(), 160.0 + 20.0 + 30.0);  // radius and range
  }
}

TEST(ViewCorrelation, LeavesOutWhatTheCloudDoesNotShow) {
  const cv::Mat paint = patches(kWallSize, 11);
  cv::Mat seen = everywhere(kWallSize);
  seen(cv::Rect(160, 0, 160, 240)).setTo(0);
  const Wall half{.paint = paint, .view = wall_view(paint, seen)};
  const ViewCorrelation correlation = half.against(paint, 1);
  ASSERT_FALSE(correlation.patches.empty());
  for (const CorrelationPatch& patch : correlation.patches) {
    EXPECT_LT(patch.pixel_px.x(), 165.0);
  }
  const Wall far{.paint = paint, .view = wall_view(paint, everywhere(kWallSize), 1.0F, 70.0F)};
  EXPECT_TRUE(far.against(paint, 1).patches.empty());
}

/// Camera pose from which the wall appears shifted by so much.
RigidTransform camera_seeing_shift(const PinholeCamera& camera, double du, double dv) {
  return {Eigen::Matrix3d::Identity(),
          {-du * static_cast<double>(kWallDepth_m) / camera.fx_px,
           -dv * static_cast<double>(kWallDepth_m) / camera.fy_px, 0.0}};
}

TEST(ViewCorrelation, AgreesBestAtThePoseThatTheImageWasTakenFrom) {
  const Wall wall;
  const PinholeCamera& camera = wall.view.camera;
  for (const int shrink : {1, 2}) {
    const ViewCorrelation correlation = wall.against(shifted(wall.paint, 12, -8), shrink);
    const auto total = [&](double du, double dv) {
      double sum = 0.0;
      for (const CorrelationPatch& patch : correlation.patches) {
        sum +=
            agreement(correlation, patch, 2, camera, camera_seeing_shift(camera, du, dv).inverse());
      }
      return sum;
    };
    const double best = total(12.0, -8.0);
    EXPECT_NEAR(best, summed(correlation, 2).at<float>(30 - 8 / shrink, 30 + 12 / shrink),
                1e-3 * best);
    EXPECT_GT(best, total(12.0 + 2.0 * shrink, -8.0));
    EXPECT_GT(best, total(12.0, -8.0 - 2.0 * shrink));
    EXPECT_GT(best, 2.0 * total(0.0, 0.0));
  }
}

TEST(ViewCorrelation, SaysNothingBeyondItsRange) {
  const Wall wall;
  const PinholeCamera& camera = wall.view.camera;
  for (const int shrink : {1, 2}) {
    const ViewCorrelation correlation = wall.against(wall.paint, shrink);
    ASSERT_FALSE(correlation.patches.empty());
    const double beyond_px = 30.0 * shrink + 0.1;
    const RigidTransform behind{Eigen::Matrix3d::Identity(), {0.0, 0.0, 11.0}};
    bool any_within = false;
    for (const CorrelationPatch& patch : correlation.patches) {
      const auto at = [&](const RigidTransform& T_world_cam) {
        return agreement(correlation, patch, 2, camera, T_world_cam.inverse());
      };
      EXPECT_EQ(at(camera_seeing_shift(camera, beyond_px, 0.0)), 0.0);
      EXPECT_EQ(at(camera_seeing_shift(camera, -beyond_px, 0.0)), 0.0);
      EXPECT_EQ(at(camera_seeing_shift(camera, 0.0, beyond_px)), 0.0);
      EXPECT_EQ(at(camera_seeing_shift(camera, 0.0, -beyond_px)), 0.0);
      EXPECT_EQ(at(behind), 0.0);
      any_within = any_within || at(camera_seeing_shift(camera, beyond_px - 0.2, 0.0)) != 0.0;
    }
    EXPECT_TRUE(any_within);
  }
}

}  // namespace
}  // namespace topoloc::refinement

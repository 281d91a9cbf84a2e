// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/lift.hpp"

#include "unit/mapping/synthetic_cloud.hpp"

#include <random>

#include <gtest/gtest.h>

namespace topoloc::mapping {
namespace {

RenderedView view_of(const DepthOfPixel& depth, double step_u_px = 1.0, double step_v_px = 1.0) {
  PointCloud cloud;
  scan(cloud, step_u_px, step_v_px, depth);
  return render(CloudGrid(std::move(cloud)), kCamera, {});
}

/// A wall that comes nearer to the right: inverse depth is affine in the pixel.
double slanted_wall(double u, double /*v*/) { return 1.0 / (0.05 + 0.0006 * u); }

TEST(Lift, IsExactOnPlanes) {
  const RenderedView view = view_of(slanted_wall);
  for (const double u : {20.4, 80.0, 140.7}) {
    const Lift lifted = lift(view, {u, 60.3});
    ASSERT_EQ(lifted.verdict, LiftVerdict::kLifted);
    EXPECT_NEAR(lifted.depth_m, slanted_wall(u, 60.3), 1e-4);
  }
}

TEST(Lift, IsExactBetweenSparseScanLinesOnTheGround) {
  const RenderedView view =
      view_of([](double, double v) { return ground_depth(v, 1.65, 60.0); }, 1.3, 6.0);
  for (const double v : {73.0, 80.5, 95.0}) {
    const Lift lifted = lift(view, {60.0, v});
    ASSERT_EQ(lifted.verdict, LiftVerdict::kLifted) << v;
    EXPECT_NEAR(lifted.depth_m, ground_depth(v, 1.65, 60.0), 1e-3) << v;
  }
}

TEST(Lift, NeverBridgesAStep) {
  const RenderedView view = view_of([](double u, double) { return u < 80.0 ? 8.0 : 11.0; });
  for (double u = 70.0; u <= 90.0; u += 0.25) {
    const Lift lifted = lift(view, {u, 60.0});
    if (lifted.verdict == LiftVerdict::kLifted) {
      EXPECT_NEAR(lifted.depth_m, u < 79.8 ? 8.0 : 11.0, 0.05) << u;
    } else {
      EXPECT_EQ(lifted.verdict, LiftVerdict::kDepthEdge) << u;
      EXPECT_LT(std::abs(u - 79.8), 4.0);
    }
  }
  EXPECT_EQ(lift(view, {79.8, 60.0}).verdict, LiftVerdict::kDepthEdge);
}

TEST(Lift, TakesNoDepthBetweenPoleAndWall) {
  PointCloud cloud;
  scan(cloud, 1.0, 1.5, [](double u, double) { return u > 70.0 && u < 74.5 ? 8.0 : 0.0; });
  scan(cloud, 1.0, 1.0, wall(10.0));
  const RenderedView view = render(CloudGrid(std::move(cloud)), kCamera, {});
  for (double u = 60.0; u < 85.0; u += 0.5) {
    const Lift lifted = lift(view, {u, 60.2});
    if (lifted.verdict == LiftVerdict::kLifted) {
      EXPECT_TRUE(std::abs(lifted.depth_m - 8.0) < 0.1 || std::abs(lifted.depth_m - 10.0) < 0.1)
          << u << ": " << lifted.depth_m;
    }
  }
  EXPECT_EQ(lift(view, {62.0, 60.2}).verdict, LiftVerdict::kLifted);
  EXPECT_EQ(lift(view, {83.0, 60.2}).verdict, LiftVerdict::kLifted);
}

TEST(Lift, NeverExtrapolates) {
  const RenderedView view =
      view_of([](double u, double v) { return u < 80.0 ? slanted_wall(u, v) : 0.0; });
  EXPECT_EQ(lift(view, {78.0, 60.0}).verdict, LiftVerdict::kLifted);
  EXPECT_EQ(lift(view, {84.0, 60.0}).verdict, LiftVerdict::kExtrapolated);
  EXPECT_EQ(lift(view, {120.0, 60.0}).verdict, LiftVerdict::kNoPoints);
}

TEST(Lift, OnASingleScanLineAdmitsThatTheSlopeIsUnknown) {
  const RenderedView view =
      view_of([](double, double v) { return std::abs(v - 60.3) < 0.4 ? 10.0 : 0.0; });
  const Lift on_line = lift(view, {80.0, 60.5});
  ASSERT_EQ(on_line.verdict, LiftVerdict::kLifted);
  EXPECT_NEAR(on_line.depth_m, 10.0, 0.01);
  EXPECT_GE(on_line.depth_std_m, 0.3);
  EXPECT_EQ(lift(view, {80.0, 64.0}).verdict, LiftVerdict::kExtrapolated);
}

TEST(Lift, DeviationCoversTheErrorOnARoughSurface) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise_m(0.0, 0.1);
  const RenderedView view =
      view_of([&](double, double) { return 10.0 + noise_m(random); }, 0.9, 1.9);
  int lifted_count = 0;
  double normalised_squares = 0.0;
  for (double v = 15.0; v < 105.0; v += 5.0) {
    for (double u = 15.0; u < 145.0; u += 5.0) {
      const Lift lifted = lift(view, {u, v});
      if (lifted.verdict == LiftVerdict::kLifted) {
        ++lifted_count;
        normalised_squares += std::pow((lifted.depth_m - 10.0) / lifted.depth_std_m, 2);
        EXPECT_GT(lifted.depth_std_m, 0.04);
        EXPECT_LT(lifted.depth_std_m, 0.3);
      }
    }
  }
  EXPECT_GT(lifted_count, 250);
  EXPECT_LT(normalised_squares / lifted_count, 1.0);
}

}  // namespace
}  // namespace topoloc::mapping

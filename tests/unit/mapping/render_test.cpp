// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/render.hpp"

#include "topoloc/geometry/so3.hpp"

#include "unit/mapping/synthetic_cloud.hpp"

#include <algorithm>
#include <limits>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace topoloc::mapping {
namespace {

/// Pixels of a rectangle that show a depth in (from, to).
int count(const RenderedView& view, int u0, int u1, int v0, int v1, float from_m, float to_m) {
  int n = 0;
  for (int v = v0; v < v1; ++v) {
    for (int u = u0; u < u1; ++u) {
      const float depth_m = view.depth_m[view.index(u, v)];
      n += !view.is_hole(u, v) && depth_m > from_m && depth_m < to_m ? 1 : 0;
    }
  }
  return n;
}

TEST(Render, GivesDepthIntensityAndPointOfAWall) {
  PointCloud cloud;
  scan(cloud, 1.0, 1.0, wall(10.0), 42.0F);
  const CloudGrid grid(std::move(cloud));
  const RenderedView view = render(grid, kCamera, {});
  EXPECT_GT(view.coverage(), 0.97);
  const std::size_t at = view.index(80, 60);
  EXPECT_NEAR(view.depth_m[at], 10.0, 1e-4);
  EXPECT_EQ(view.intensity[at], 42.0F);
  const Eigen::Vector2d pixel_px = kCamera.project(grid.cloud().position_world(view.point[at]));
  EXPECT_LT((pixel_px - view.pixel_px[at].cast<double>()).norm(), 1e-4);
  EXPECT_LT((pixel_px - Eigen::Vector2d(80, 60)).lpNorm<Eigen::Infinity>(), 0.501);
}

TEST(Render, NothingShinesThroughASparseWall) {
  PointCloud cloud;
  scan(cloud, 1.3, 2.1, wall(3.0));   // near wall in scan lines 6 cm apart
  scan(cloud, 0.7, 0.7, wall(15.0));  // dense wall behind it
  const RenderedView view = render(CloudGrid(std::move(cloud)), kCamera, {});
  EXPECT_EQ(count(view, 6, 154, 6, 114, 10.0F, 99.0F), 0);
  EXPECT_GT(count(view, 6, 154, 6, 114, 0.0F, 10.0F), 3000);
}

TEST(Render, KeepsWhatStandsBesideAnEdge) {
  PointCloud cloud;
  scan(cloud, 1.0, 1.0, [](double u, double) { return u < 80.0 ? 6.0 : 15.0; });
  const RenderedView view = render(CloudGrid(std::move(cloud)), kCamera, {});
  EXPECT_EQ(count(view, 81, 155, 5, 115, 10.0F, 99.0F), 74 * 110);
}

TEST(Render, ShowsAPoleInFrontOfAWallAndTheWallBesideIt) {
  PointCloud cloud;
  scan(cloud, 1.0, 1.5, [](double u, double) { return u > 70.0 && u < 76.0 ? 8.0 : 0.0; });
  scan(cloud, 0.8, 0.8, wall(12.0));
  const RenderedView view = render(CloudGrid(std::move(cloud)), kCamera, {});
  EXPECT_EQ(count(view, 72, 75, 10, 110, 10.0F, 99.0F), 0);
  EXPECT_GT(count(view, 71, 76, 10, 110, 0.0F, 10.0F), 200);
  EXPECT_EQ(count(view, 78, 90, 10, 110, 10.0F, 99.0F), 12 * 100);
}

TEST(Render, GroundDoesNotHideTheGroundBehindIt) {
  PointCloud cloud;
  scan(cloud, 1.0, 1.0, [](double, double v) { return ground_depth(v, 1.65, 60.0); });
  const auto points = static_cast<double>(cloud.size());
  const RenderedView view = render(CloudGrid(std::move(cloud)), kCamera, {});
  EXPECT_GT(view.coverage() * 160 * 120, 0.98 * points);
}

TEST(Render, DoesNotDependOnTheOrderOfThePoints) {
  PointCloud cloud;
  scan(cloud, 1.3, 3.1, wall(6.0));
  scan(cloud, 0.7, 0.7, wall(15.0));
  PointCloud shuffled = cloud;
  std::shuffle(shuffled.positions_m.begin(), shuffled.positions_m.end(), std::mt19937(7));
  const RenderedView a = render(CloudGrid(std::move(cloud)), kCamera, {});
  const RenderedView b = render(CloudGrid(std::move(shuffled)), kCamera, {});
  EXPECT_EQ(a.depth_m, b.depth_m);
}

TEST(CloudGrid, FindsEveryPointInViewAndLeavesMostCellsAlone) {
  PointCloud cloud;
  cloud.origin_m = {500'000.0, 5'000'000.0, 100.0};
  std::mt19937 random(1);
  std::uniform_real_distribution<float> coordinate(-200.0F, 200.0F);
  for (int i = 0; i < 20'000; ++i) {
    cloud.positions_m.emplace_back(coordinate(random), coordinate(random),
                                   0.1F * coordinate(random));
    cloud.intensities.push_back(0.0F);
  }
  const CloudGrid grid(std::move(cloud));
  const RigidTransform T_world_cam{so3::exp({-1.5, 0.2, 0.1}),
                                   grid.cloud().origin_m + Eigen::Vector3d(20.0, -30.0, 2.0)};
  const double max_depth_m = 60.0;
  std::set<std::uint32_t> candidates;
  std::size_t cells = 0;
  for (const CloudGrid::Cell& cell : grid.cells_in_view(kCamera, T_world_cam, max_depth_m)) {
    ++cells;
    for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
      EXPECT_TRUE(candidates.insert(i).second);
    }
  }
  EXPECT_LT(cells, grid.cells().size() / 8);  // cost follows the view, not the map
  int in_view = 0;
  for (std::uint32_t i = 0; i < grid.cloud().size(); ++i) {
    const Eigen::Vector3d q_cam = T_world_cam.inverse() * grid.cloud().position_world(i);
    if (q_cam.z() > 0.0 && q_cam.z() < max_depth_m && kCamera.contains(kCamera.project(q_cam))) {
      ++in_view;
      EXPECT_TRUE(candidates.contains(i));
    }
  }
  EXPECT_GT(in_view, 50);
}

TEST(CloudGrid, SeesNothingFromElsewhere) {
  PointCloud cloud;
  scan(cloud, 5.0, 5.0, wall(10.0));
  const CloudGrid grid(std::move(cloud));
  RigidTransform T_world_cam;
  T_world_cam.p.x() = 1e9;
  EXPECT_TRUE(grid.cells_in_view(kCamera, T_world_cam, 80.0).empty());
  T_world_cam.p = {0.0, std::numeric_limits<double>::quiet_NaN(), 0.0};
  EXPECT_TRUE(grid.cells_in_view(kCamera, T_world_cam, 80.0).empty());
  T_world_cam = {so3::exp({0.0, 3.1, 0.0}), {0.0, 0.0, -30.0}};
  EXPECT_TRUE(grid.cells_in_view(kCamera, T_world_cam, 80.0).empty());
}

}  // namespace
}  // namespace topoloc::mapping

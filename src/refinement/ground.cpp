// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/ground.hpp"

#include "topoloc/evaluation/median.hpp"
#include "topoloc/mapping/render.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

namespace topoloc::refinement {

std::optional<Ground> ground_below(const mapping::CloudGrid& grid, const Eigen::Vector3d& p_world) {
  // A camera that looks down from above the point sees the ground as a depth image.
  constexpr double kAbove_m = 1.0;
  constexpr double kDeepest_m = 5.0;
  constexpr int kSide_px = 61;
  constexpr double kFocal_px = 60.0;
  constexpr std::size_t kMinPoints = 40;
  constexpr double kFlat_m = 0.08;
  const PinholeCamera camera{
      kSide_px, kSide_px, kFocal_px, kFocal_px, 0.5 * (kSide_px - 1), 0.5 * (kSide_px - 1)};
  RigidTransform T_world_down;
  T_world_down.R << 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0;
  T_world_down.p = p_world + Eigen::Vector3d(0.0, 0.0, kAbove_m);
  mapping::RenderConfig config;
  config.min_depth_m = kAbove_m + 0.2;  // below the point
  config.max_depth_m = kDeepest_m;
  const mapping::RenderedView view = mapping::render(grid, camera, T_world_down, config);

  std::vector<Eigen::Vector3d> points;  // relative to p_world
  for (std::size_t i = 0; i < view.point.size(); ++i) {
    if (view.point[i] != mapping::RenderedView::kHole) {
      points.emplace_back(grid.cloud().position_world(view.point[i]) - p_world);
    }
  }
  if (points.size() < kMinPoints) {
    return std::nullopt;
  }
  // Begin with what lies near the median height; then a plane, and again without what is off it.
  std::vector<double> heights;
  heights.reserve(points.size());
  for (const Eigen::Vector3d& point : points) {
    heights.push_back(point.z());
  }
  Eigen::Vector3d plane(evaluation::median(std::move(heights)), 0.0, 0.0);
  std::size_t used = 0;
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    const double tolerance_m = round == 0 ? 3.0 * kFlat_m : kFlat_m;
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    used = 0;
    for (const Eigen::Vector3d& point : points) {
      const Eigen::Vector3d row(1.0, point.x(), point.y());
      if (std::abs(point.z() - row.dot(plane)) < tolerance_m) {
        A += row * row.transpose();
        b += row * point.z();
        ++used;
      }
    }
    if (used < kMinPoints) {
      return std::nullopt;
    }
    plane = A.ldlt().solve(b);
  }
  if (2 * used < points.size()) {
    return std::nullopt;
  }
  return Ground{p_world.head<2>(), p_world.z() + plane(0), plane.tail<2>()};
}

}  // namespace topoloc::refinement

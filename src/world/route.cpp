// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/world/route.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace topoloc::world {
namespace {

constexpr double kKnot_m = 0.25;

Eigen::Vector3d direction(double heading_rad, double slope) {
  return Eigen::Vector3d(std::cos(heading_rad), std::sin(heading_rad), slope).normalized();
}

}  // namespace

Route::Route(std::vector<Stretch> stretches) : stretches_(std::move(stretches)) {
  for (const Stretch& stretch : stretches_) {
    if (!(stretch.length_m > 0.0)) {
      throw std::invalid_argument("a stretch of road needs a length");
    }
    length_m_ += stretch.length_m;
  }
  if (stretches_.empty()) {
    throw std::invalid_argument("a route needs a stretch of road");
  }
  Knot knot;
  knot.setting = stretches_.front().setting;
  std::size_t index = 0;
  double begin_m = 0.0;  // of the stretch
  Knot before = knot;    // at its begin
  const auto count = static_cast<std::size_t>(std::ceil(length_m_ / kKnot_m)) + 1;
  knots_.reserve(count + 1);
  knots_.push_back(knot);
  for (std::size_t i = 1; i <= count; ++i) {
    const double along_m = static_cast<double>(i) * kKnot_m;
    while (index + 1 < stretches_.size() && along_m > begin_m + stretches_[index].length_m) {
      begin_m += stretches_[index].length_m;
      before.curvature_1pm = stretches_[index].end_curvature_1pm;
      before.slope = stretches_[index].end_slope;
      ++index;
    }
    const Stretch& stretch = stretches_[index];
    const double share = std::min(1.0, (along_m - begin_m) / stretch.length_m);
    Knot next;
    next.setting = stretch.setting;
    next.curvature_1pm = std::lerp(before.curvature_1pm, stretch.end_curvature_1pm, share);
    next.slope = std::lerp(before.slope, stretch.end_slope, share);
    // Midpoint rule; 0.25 m of a road's curve are a few micrometres off.
    next.heading_rad = knot.heading_rad + kKnot_m * 0.5 * (knot.curvature_1pm + next.curvature_1pm);
    next.p = knot.p + kKnot_m * direction(0.5 * (knot.heading_rad + next.heading_rad),
                                          0.5 * (knot.slope + next.slope));
    knots_.push_back(next);
    knot = next;
  }
}

Route::Knot Route::at(double along_m) const {
  const double inside_m = std::clamp(along_m, 0.0, length_m_);
  const auto index = std::min(static_cast<std::size_t>(inside_m / kKnot_m), knots_.size() - 2);
  const Knot& a = knots_[index];
  const Knot& b = knots_[index + 1];
  const double share = inside_m / kKnot_m - static_cast<double>(index);
  Knot result;
  result.setting = share < 0.5 ? a.setting : b.setting;
  result.curvature_1pm = std::lerp(a.curvature_1pm, b.curvature_1pm, share);
  result.slope = std::lerp(a.slope, b.slope, share);
  result.heading_rad = std::lerp(a.heading_rad, b.heading_rad, share);
  // Cubic Hermite: smooth to the second derivative's eye.
  const double t = share;
  const double t2 = t * t;
  const double t3 = t2 * t;
  result.p = (2 * t3 - 3 * t2 + 1) * a.p + (3 * t2 - 2 * t3) * b.p +
             kKnot_m * ((t3 - 2 * t2 + t) * direction(a.heading_rad, a.slope) +
                        (t3 - t2) * direction(b.heading_rad, b.slope));
  if (along_m != inside_m) {
    result.p += (along_m - inside_m) * direction(result.heading_rad, result.slope);
    result.curvature_1pm = 0.0;
  }
  return result;
}

RigidTransform Route::T_world_road(double along_m) const {
  const Knot knot = at(along_m);
  RigidTransform result;
  result.p = knot.p;
  const Eigen::Vector3d x = direction(knot.heading_rad, knot.slope);
  const Eigen::Vector3d y(-std::sin(knot.heading_rad), std::cos(knot.heading_rad), 0.0);
  result.R.col(0) = x;
  result.R.col(1) = y;
  result.R.col(2) = x.cross(y);
  return result;
}

double Route::curvature_1pm(double along_m) const { return at(along_m).curvature_1pm; }

Setting Route::setting(double along_m) const { return at(along_m).setting; }

}  // namespace topoloc::world

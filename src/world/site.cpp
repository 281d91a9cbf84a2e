// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/site.hpp"

#include "world/steps.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::world {
namespace {

constexpr double kPlace_m = 2.0;
constexpr double kCell_m = 0.5;

std::int64_t cell_of(double x, double y, double size_m) {
  const auto ix = static_cast<std::int64_t>(std::floor(x / size_m));
  const auto iy = static_cast<std::int64_t>(std::floor(y / size_m));
  return ix * 0x100000000LL + iy;
}

}  // namespace

Site::Site(const Route& route, double behind_m, double beyond_m) {
  low_ = high_ = Eigen::Vector2d::Zero();
  for (const double s : steps(-behind_m, route.length_m() + beyond_m + 1e-9, kPlace_m)) {
    const RigidTransform T = route.T_world_road(s);
    places_.push_back({T.p.head<2>(), T.R.col(1).head<2>(), s, T.p.z()});
    low_ = low_.cwiseMin(T.p.head<2>());
    high_ = high_.cwiseMax(T.p.head<2>());
  }
}

Site::Nearest Site::nearest(const Eigen::Vector2d& p) const {
  // Every tenth place, then all about the best of them.
  constexpr std::size_t kCoarse = 10;
  double best = 1e18;
  std::size_t index = 0;
  const auto look = [&](std::size_t i) {
    const double d = (places_[i].p - p).squaredNorm();
    if (d < best) {
      best = d;
      index = i;
    }
  };
  for (std::size_t i = 0; i < places_.size(); i += kCoarse) {
    look(i);
  }
  const std::size_t middle = index;
  for (std::size_t i = middle - std::min(middle, kCoarse);
       i < std::min(middle + kCoarse, places_.size()); ++i) {
    look(i);
  }
  const Place& place = places_[index];
  const Eigen::Vector2d forward(place.left.y(), -place.left.x());
  Nearest result;
  result.along_m = place.along_m + std::clamp(forward.dot(p - place.p), -kPlace_m, kPlace_m);
  result.distance_m = std::abs(place.left.dot(p - place.p));
  if (best > std::pow(result.distance_m + kPlace_m, 2)) {
    result.distance_m = std::sqrt(best);  // beyond an end of the route
  }
  result.height_m = place.height_m;
  result.left = place.left.dot(p - place.p) > 0.0;
  return result;
}

double Site::land_m(const Eigen::Vector2d& p) const {
  double weights = 0.0;
  double heights = 0.0;
  for (std::size_t i = 0; i < places_.size(); i += 4) {
    const double d2 = (places_[i].p - p).squaredNorm() + 25.0;
    const double weight = 1.0 / (d2 * d2);
    weights += weight;
    heights += weight * places_[i].height_m;
  }
  return heights / weights;
}

template <typename Visit>
bool Site::cells(const Eigen::Vector2d& corner, const Eigen::Vector2d& along,
                 const Eigen::Vector2d& across, Visit visit) const {
  const int n = std::max(1, static_cast<int>(std::ceil(along.norm() / kCell_m * 1.2)));
  const int m = std::max(1, static_cast<int>(std::ceil(across.norm() / kCell_m * 1.2)));
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= m; ++j) {
      const Eigen::Vector2d p =
          corner + along * (static_cast<double>(i) / n) + across * (static_cast<double>(j) / m);
      if (!visit(cell_of(p.x(), p.y(), kCell_m))) {
        return false;
      }
    }
  }
  return true;
}

bool Site::is_free(const Eigen::Vector2d& corner, const Eigen::Vector2d& along,
                   const Eigen::Vector2d& across) const {
  return cells(corner, along, across, [&](std::int64_t cell) { return !taken_.contains(cell); });
}

bool Site::is_free(const Eigen::Vector2d& p) const {
  return !taken_.contains(cell_of(p.x(), p.y(), kCell_m));
}

void Site::claim(const Eigen::Vector2d& corner, const Eigen::Vector2d& along,
                 const Eigen::Vector2d& across) {
  std::vector<std::int64_t> found;
  cells(corner, along, across, [&](std::int64_t cell) {
    found.push_back(cell);
    return true;
  });
  taken_.insert(found.begin(), found.end());
}

}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/world/route.hpp"

#include <cstdint>
#include <unordered_set>
#include <vector>

#include <Eigen/Core>

namespace topoloc::world {

/// What ground is taken, seen from above; and where the route is from anywhere.
class Site {
 public:
  explicit Site(const Route& route, double behind_m, double beyond_m);

  struct Nearest {
    double along_m = 0.0;
    double distance_m = 0.0;
    double height_m = 0.0;  ///< of the road there
    bool left = false;
  };
  /// Route's place nearest to a point seen from above. Half-way between two legs of the route
  /// either may be named.
  [[nodiscard]] Nearest nearest(const Eigen::Vector2d& p) const;

  /// Smooth height of the land: the road's, averaged over what is near.
  [[nodiscard]] double land_m(const Eigen::Vector2d& p) const;

  /// A rectangle: corner and two sides.
  [[nodiscard]] bool is_free(const Eigen::Vector2d& corner, const Eigen::Vector2d& along,
                             const Eigen::Vector2d& across) const;
  void claim(const Eigen::Vector2d& corner, const Eigen::Vector2d& along,
             const Eigen::Vector2d& across);
  [[nodiscard]] bool is_free(const Eigen::Vector2d& p) const;

  [[nodiscard]] Eigen::Vector2d low() const { return low_; }
  [[nodiscard]] Eigen::Vector2d high() const { return high_; }

 private:
  struct Place {
    Eigen::Vector2d p;
    Eigen::Vector2d left;
    double along_m;
    double height_m;
  };
  template <typename Visit>
  bool cells(const Eigen::Vector2d& corner, const Eigen::Vector2d& along,
             const Eigen::Vector2d& across, Visit visit) const;

  std::vector<Place> places_;               ///< every 2 m
  std::unordered_set<std::int64_t> taken_;  ///< cells of half a metre
  Eigen::Vector2d low_;
  Eigen::Vector2d high_;
};

}  // namespace topoloc::world

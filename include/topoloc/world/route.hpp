// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace topoloc::world {

/// What surrounds a stretch of road.
enum class Setting : std::uint8_t { kTown, kHighway, kTunnel };

/// A stretch of road. Curvature and slope change linearly along it, from those at the end of the
/// stretch before (clothoids), so the road is smooth where stretches meet.
struct Stretch {
  Setting setting = Setting::kTown;
  double length_m = 0.0;
  double end_curvature_1pm = 0.0;  ///< positive: to the left
  double end_slope = 0.0;          ///< rise over run; positive: uphill
};

/// The road driven, as a line in space: its reference line, the middle of the carriageway.
///
/// Frame `road` at a place: x along, y left, z up off the road's surface. Traffic keeps right, so
/// the lanes driven have negative offsets. The world's axes are east, north, up; the road begins at
/// the origin heading east.
class Route {
 public:
  explicit Route(std::vector<Stretch> stretches);

  [[nodiscard]] double length_m() const { return length_m_; }
  /// Frame of the road at a way along it; outside [0, length] it goes straight on.
  [[nodiscard]] RigidTransform T_world_road(double along_m) const;
  [[nodiscard]] Eigen::Vector3d point(double along_m, double left_m, double up_m = 0.0) const {
    return T_world_road(along_m) * Eigen::Vector3d(0.0, left_m, up_m);
  }
  [[nodiscard]] double curvature_1pm(double along_m) const;
  [[nodiscard]] Setting setting(double along_m) const;
  [[nodiscard]] const std::vector<Stretch>& stretches() const { return stretches_; }

 private:
  struct Knot {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    double heading_rad = 0.0;
    double slope = 0.0;
    double curvature_1pm = 0.0;
    Setting setting = Setting::kTown;
  };
  [[nodiscard]] Knot at(double along_m) const;

  std::vector<Stretch> stretches_;
  double length_m_ = 0.0;
  std::vector<Knot> knots_;  ///< every kKnot_m
};

}  // namespace topoloc::world

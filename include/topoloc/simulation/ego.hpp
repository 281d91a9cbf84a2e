// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/simulation/journey.hpp"
#include "topoloc/simulation/trajectory.hpp"
#include "topoloc/simulation/vehicle_model.hpp"

#include <cstdint>

namespace topoloc::simulation {

struct EgoSpec {
  Path::Options path;
  DrivingStyle style;
  VehicleModel vehicle;
  double from_m = 3.0;         ///< where the drive begins along the route
  double before_end_m = 15.0;  ///< and where it ends
};

/// The vehicle's own drive: the truth.
struct Ego {
  Path path;
  Journey journey;
  Trajectory trajectory;  ///< of the frame `vehicle`

  [[nodiscard]] double duration_s() const { return trajectory.duration_s(); }
  [[nodiscard]] double along_m(double time_s) const { return journey.along_m(time_s); }
};

/// `road` has to outlive it. Throws std::invalid_argument where the road is too short.
Ego drive_along(const Road& road, const EgoSpec& spec, std::uint64_t key);

}  // namespace topoloc::simulation

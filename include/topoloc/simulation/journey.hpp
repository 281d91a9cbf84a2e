// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/simulation/path.hpp"

#include <cstdint>
#include <vector>

namespace topoloc::simulation {

/// What the driver keeps to.
struct DrivingStyle {
  double lateral_acceleration_mps2 = 2.1;  ///< aimed at; 2.5 is not exceeded
  double acceleration_mps2 = 1.2;          ///< at most, and 20 W/kg at speed
  double braking_mps2 = 1.3;
  double reversing_mps = 1.4;
  double smoothing_s = 0.6;  ///< in which a pedal is pressed: limits the jerk
  double first_stand_s = 3.0;
  double last_stand_s = 1.5;
};

/// A stretch driven without a stop, then a stand.
struct Leg {
  double from_m = 0.0;  ///< along the route
  double to_m = 0.0;    ///< less than from_m: backwards
  double stand_s = 0.0;
};

/// Stops of a drive from one place to another: in town at (imagined) traffic lights, at one of
/// which the vehicle backs up. A town of 60 m or more has at least one.
std::vector<Leg> plan_legs(const world::Route& route, double from_m, double to_m,
                           double last_stand_s, std::uint64_t key);

/// Where along the route the vehicle is when.
class Journey {
 public:
  Journey(const Path& path, const Road& road, const std::vector<Leg>& legs,
          const DrivingStyle& style, std::uint64_t key);

  [[nodiscard]] double duration_s() const { return duration_s_; }
  /// Smooth; outside the duration it stands.
  [[nodiscard]] double along_m(double time_s) const;

 private:
  std::vector<double> along_m_;  ///< every kStep_s
  double duration_s_ = 0.0;
};

}  // namespace topoloc::simulation

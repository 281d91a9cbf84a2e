// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/simulation/ego.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace topoloc::simulation {

/// Zero everywhere: ideal sensors.
struct WheelSpec {
  double rate_hz = 50.0;
  double radius_error = 0.005;  ///< all wheels alike, one standard deviation (pressure, wear)
  double single_radius_error = 0.001;  ///< of each wheel on top
  double noise_mps = 0.01;
  double dead_band_mps = 0.3;  ///< slower wheels read zero: too few teeth pass the sensor
  bool slip = false;           ///< driven wheels spin and lock now and then

  static WheelSpec ideal();
};

enum Wheel : std::size_t { kFrontLeft, kFrontRight, kRearLeft, kRearRight };

struct WheelSample {
  std::int64_t time_ns = 0;            ///< drive time
  std::array<double, 4> speeds_mps{};  ///< by Wheel, with their signs, as measured
};

/// Speeds over ground of the four wheels of a vehicle that turns about a point on the line of its
/// rear axle; front wheels are steered along their own circles.
std::array<double, 4> true_wheel_speeds(const BodyMotion& vehicle, const VehicleModel& model);

std::vector<WheelSample> sense_wheels(const Trajectory& vehicle, const VehicleModel& model,
                                      const WheelSpec& spec, std::uint64_t key);

}  // namespace topoloc::simulation

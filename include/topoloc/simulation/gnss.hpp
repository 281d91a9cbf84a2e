// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/evaluation/trajectory.hpp"
#include "topoloc/simulation/ego.hpp"

#include <cstdint>

namespace topoloc::simulation {

/// What a low-cost satellite receiver says, for comparison only: errors that wander, jumps between
/// houses, nothing in tunnels. Of the class of a u-blox M8: 2 m of CEP under an open sky.
struct GnssSpec {
  double rate_hz = 5.0;
  double horizontal_m = 1.8;  ///< per axis, one standard deviation, Gauss-Markov
  double vertical_m = 3.0;
  double correlation_s = 60.0;
  double white_m = 0.2;  ///< per axis, 1.5 times that upwards
  double jump_m = 5.0;   ///< of multipath in town, one standard deviation; 1.5 times that upwards
  double jumps_per_min = 3.0;  ///< in town
};

/// T_world_imu with the course over ground as heading, level; `time_ns` is drive time.
evaluation::Trajectory sense_satellites(const Ego& ego, const RigidTransform& T_vehicle_imu,
                                        const world::Route& route, const GnssSpec& spec,
                                        std::uint64_t key);

}  // namespace topoloc::simulation

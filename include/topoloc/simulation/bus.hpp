// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/can/frame.hpp"
#include "topoloc/estimation/measurements.hpp"
#include "topoloc/simulation/wheels.hpp"

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace topoloc::simulation {

/// How late and uneven stamps are. Zero everywhere: exact.
struct BusSpec {
  double jitter_s = 20e-6;      ///< of the moment of sampling, one standard deviation
  double max_delay_s = 0.3e-3;  ///< frames wait for others on the bus up to so long

  static BusSpec ideal() { return {.jitter_s = 0.0, .max_delay_s = 0.0}; }
};

/// The text of config/topoloc_imu_wheel.dbc.
std::string_view dbc_text();

/// All frames of a drive in the order of their stamps, encoded as the DBC says. `begin_ns`: Unix
/// time of drive time 0. Throws std::runtime_error where a value does not fit its signal.
std::vector<can::Frame> put_on_bus(std::span<const estimation::ImuSample> imu,
                                   std::span<const WheelSample> wheels, std::int64_t begin_ns,
                                   const BusSpec& spec, std::uint64_t key);

}  // namespace topoloc::simulation

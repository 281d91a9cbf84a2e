// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/config/vehicle_config.hpp"

#include "commands.hpp"

namespace topoloc::apps {

/// The configuration that --config names, with what other options put in place of its keys.
inline config::VehicleConfig load_vehicle(const Options& options) {
  config::VehicleConfig vehicle = config::load_vehicle_config(options.config);
  config::LiveConfig& live = vehicle.live;
  if (!options.can.empty()) {
    live.can_interfaces = options.can;
  }
  if (!options.lcm_url.empty()) {
    live.lcm_url = options.lcm_url;
  }
  if (!options.journal.empty()) {
    live.journal = options.journal;
  }
  if (!options.last_pose.empty()) {
    live.last_pose = options.last_pose;
  }
  return vehicle;
}

}  // namespace topoloc::apps

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/config/vehicle_config.hpp"

#include "config/sections.hpp"

namespace topoloc::config {
namespace {
constexpr int kFormat = 1;  ///< of vehicle.yaml; raised when a key changes its meaning
}

VehicleConfig load_vehicle_config(const std::filesystem::path& file) {
  StrictNode top = StrictNode::load(file);
  int format = 0;
  top.require("format", format, Range{kFormat, kFormat});

  VehicleConfig config;
  top.read("name", config.name);
  config.files.push_back(file);
  read_can(top, config.can);
  config.files.insert(config.files.end(), config.can.dbcs.begin(), config.can.dbcs.end());
  read_camera(top, config.camera, config.files);
  read_imu(top, config.estimator, config.files);
  read_mounting(top, config.estimator.models.speed);
  read_speed(top, config.estimator);
  read_standstill(top, config.estimator.models.standstill);
  read_estimator(top, config.estimator);
  read_matching(top, config.matching);
  read_live(top, config.live);
  top.finish();

  config.estimator.models.camera = {matching::matching_camera(config.matching),
                                    config.camera.kalibr.T_imu_cam.inverse()};
  return config;
}

}  // namespace topoloc::config

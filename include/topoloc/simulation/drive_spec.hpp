// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/camera_renderer.hpp"
#include "topoloc/simulation/bus.hpp"
#include "topoloc/simulation/camera_log.hpp"
#include "topoloc/simulation/gnss.hpp"
#include "topoloc/simulation/imu.hpp"
#include "topoloc/simulation/survey.hpp"
#include "topoloc/simulation/vehicle_model.hpp"
#include "topoloc/simulation/wheels.hpp"
#include "topoloc/world/world.hpp"

#include <cstdint>

namespace topoloc::simulation {

/// What is asked for.
struct DriveRequest {
  world::WorldSpec world;
  bool mapping = true;     ///< also the cloud and the rough trajectory; false: another day's drive
  std::uint64_t seed = 1;  ///< of the drive: traffic, parked cars, place in the lane, sensors
  rendering::Light light = rendering::Light::kDay;
  bool images = true;
  bool cloud = true;  ///< of a mapping drive
  bool ply = false;
  bool ideal_sensors = false;
  bool slip = false;
  double camera_hz = 10.0;
  int image_width_px = 720;
  double readout_s = 0.0;  ///< rolling shutter, first row to last; 0: global
};

/// What that means for every part of the simulation.
struct DriveSpec {
  DriveRequest request;
  std::int64_t begin_ns = 0;  ///< Unix time of drive time 0
  EgoSpec ego;
  Mounting nominal;
  Mounting built;
  ImuSpec imu;
  WheelSpec wheels;
  BusSpec bus;
  GnssSpec gnss;
  rendering::CameraSpec camera;
  CameraLogSpec camera_log;
  double stated_time_shift_s = 0.0;  ///< what camchain.yaml says
  SurveySpec survey;
  PoseError::Spec prior;
  world::VisitSpec visit;

  /// Keys of the parts' random numbers.
  enum class Part : std::uint8_t { kEgo, kImu, kWheels, kBus, kGnss, kCamera, kSurvey, kPrior };
  [[nodiscard]] std::uint64_t key(Part part) const;
};

DriveSpec drive_spec(const DriveRequest& request);

}  // namespace topoloc::simulation

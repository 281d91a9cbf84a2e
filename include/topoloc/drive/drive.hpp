// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/config/vehicle_config.hpp"
#include "topoloc/drive/frame_log.hpp"
#include "topoloc/estimation/measurements.hpp"
#include "topoloc/evaluation/trajectory.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

/// Recorded drives (docs/drive-folder.md).
namespace topoloc::drive {

/// Everything of a drive folder but the images.
struct Drive {
  std::filesystem::path dir;
  config::VehicleConfig vehicle;
  std::vector<estimation::ImuSample> imu;              ///< strictly increasing in time
  std::vector<estimation::SpeedSample> speed;          ///< strictly increasing in time
  std::optional<evaluation::Trajectory> ground_truth;  ///< ground_truth.tum: T_world_imu
  std::uint64_t can_frames = 0;
  std::uint64_t lost_messages = 0;  ///< missing in can.log, as far as counters tell (can.checks)
  /// What of can.log was not used, by reason; reasons that did not occur are left out.
  std::map<std::string, std::uint64_t> rejected;
  std::string first_malformed_line;  ///< of can.log, in words; empty if there was none
};

/// Reads vehicle.yaml, can.log and, where present, ground_truth.tum of a drive folder. `vehicle`
/// replaces the folder's vehicle.yaml unless empty. Throws config::ConfigError or
/// std::runtime_error that names the file; a log without IMU samples is an error.
Drive load_drive(const std::filesystem::path& dir, const std::filesystem::path& vehicle = {});

/// Opens camera.lcm of a drive with the channel, image size and time offset of its vehicle.
FrameLog open_frames(const Drive& drive);

/// The mask that a camera's configuration names: CV_8UC1 of the raw image's size, 0 = ignore; empty
/// where it names none. Throws std::runtime_error that names the file where it cannot be read or
/// has another size.
cv::Mat read_mask(const config::CameraConfig& camera);

}  // namespace topoloc::drive

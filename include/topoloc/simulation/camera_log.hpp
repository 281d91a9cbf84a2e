// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/camera_renderer.hpp"
#include "topoloc/simulation/ego.hpp"
#include "topoloc/world/world.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>

namespace topoloc::simulation {

/// How frames are stamped and stored.
struct CameraLogSpec {
  /// Stamps are earlier than mid-exposure by it, on the IMU's clock (Kalibr's timeshift_cam_imu).
  double time_shift_s = 0.0124;
  double jitter_s = 30e-6;  ///< of a stamp, one standard deviation
  int jpeg_quality = 90;
};

struct CameraLogCounts {
  std::uint64_t frames = 0;
  std::uint64_t bytes = 0;
};

/// Renders what the camera sees along a drive into an LCM log on channel CAMERA, as MJPEG.
/// `progress`: share done. Throws std::runtime_error on a write error.
CameraLogCounts film(rendering::Raycaster& raycaster, const Ego& ego, const world::Visit& visit,
                     const RigidTransform& T_vehicle_cam, const rendering::CameraSpec& camera,
                     rendering::Light light, const CameraLogSpec& spec, std::int64_t begin_ns,
                     std::uint64_t key, const std::filesystem::path& file,
                     const std::function<void(double)>& progress);

}  // namespace topoloc::simulation

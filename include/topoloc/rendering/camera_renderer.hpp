// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/rendering/raycaster.hpp"

#include <cstdint>
#include <functional>
#include <string_view>

#include <opencv2/core.hpp>

namespace topoloc::rendering {

enum class Light : std::uint8_t { kDay, kOvercast, kDusk, kNight };
std::string_view name(Light light);
/// Throws std::invalid_argument that lists the names.
Light light_of(std::string_view name);

/// A grey camera of a car, lens to bytes.
struct CameraSpec {
  CameraCalibration calibration;
  double rate_hz = 10.0;
  double min_exposure_s = 0.0001;
  double max_exposure_s = 0.015;
  double readout_s = 0.0;    ///< rolling shutter: from the first row to the last; 0: global
  double vignetting = 0.35;  ///< share of light lost in the corners
  double full_well_electrons = 10000.0;
  double read_noise_electrons = 6.0;
  int samples_per_pixel = 4;
};

/// T_world_cam at a time relative to mid-exposure [s]: the camera moves while it exposes.
using CameraMotion = std::function<RigidTransform(double since_mid_exposure_s)>;

/// Renders what the camera sees, frame after frame: exposure control needs the frames before.
class CameraRenderer {
 public:
  /// `head_lamps`: the vehicle's own are lit (dusk, night, tunnel). All threads of the machine are
  /// used; bytes do not depend on how many there are.
  CameraRenderer(const Raycaster& raycaster, CameraSpec spec, Light light, std::uint64_t seed);

  /// CV_8UC1 of the raw (distorted) image. `frame`: number of the frame, for its noise.
  cv::Mat render(const CameraMotion& T_world_cam, std::uint64_t frame);

  /// Depth along the optical axis [m] of each pixel's centre, CV_32FC1; 0: sky.
  [[nodiscard]] cv::Mat depth(const RigidTransform& T_world_cam) const;

  [[nodiscard]] double exposure_s() const { return exposure_s_; }

 private:
  const Raycaster* raycaster_;
  CameraSpec spec_;
  Light light_;
  std::uint64_t seed_;
  double exposure_s_ = 0.0;
};

}  // namespace topoloc::rendering

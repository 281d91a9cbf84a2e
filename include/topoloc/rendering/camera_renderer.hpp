// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/rendering/raycaster.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
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
  int samples_per_pixel = 4;     ///< 1 to 16
  double electrons_per_s = 1e8;  ///< of a pixel that sees white in full day light (100 klx)
  double max_gain = 16.0;        ///< where the longest exposure does not do
  double target_level = 0.42;    ///< mean of the image that exposure control aims at, 1: white
  /// Head lamps (frame: middle between them, x forward, y left, z up) to camera; none without.
  std::optional<RigidTransform> T_cam_lamps;
};

/// T_world_cam at a time relative to mid-exposure [s]: the camera moves while it exposes.
using CameraMotion = std::function<RigidTransform(double since_mid_exposure_s)>;

/// Renders what the camera sees, frame after frame: exposure control needs the frames before.
class CameraRenderer {
 public:
  /// `raycaster` has to outlive it. The vehicle's own head lamps are lit at dusk, at night and in
  /// tunnels. `seed`: of the day, its sun, clouds and noise. `threads`: 0 for one per usable CPU;
  /// bytes do not depend on how many there are. Throws std::invalid_argument for a spec that no
  /// camera has.
  CameraRenderer(const Raycaster& raycaster, const CameraSpec& spec, Light light,
                 std::uint64_t seed, int threads = 0);
  ~CameraRenderer();
  CameraRenderer(CameraRenderer&&) noexcept;
  CameraRenderer& operator=(CameraRenderer&&) noexcept;

  /// CV_8UC1 of the raw (distorted) image. `frame`: number of the frame, for its noise. Times are
  /// relative to mid-exposure of the middle row; called from this thread only. Bytes follow light
  /// by the sRGB curve, as those of cameras whose images people look at do: linear bytes would
  /// spend 8 bits on the sky and leave shadows none.
  cv::Mat render(const CameraMotion& T_world_cam, std::uint64_t frame);

  /// Depth along the optical axis [m] of each pixel's centre, CV_32FC1; 0: sky.
  [[nodiscard]] cv::Mat depth(const RigidTransform& T_world_cam) const;

  [[nodiscard]] double exposure_s() const;  ///< of the last frame
  [[nodiscard]] double gain() const;        ///< of the last frame; 1 until exposure is longest

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace topoloc::rendering

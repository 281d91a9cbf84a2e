// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/camera_renderer.hpp"

#include <cstdint>

namespace topoloc::rendering {

/// Photon counts to bytes.
class Sensor {
 public:
  explicit Sensor(const CameraSpec& spec);

  /// Share of light that vignetting leaves a pixel.
  [[nodiscard]] float vignetting(int row, int column) const;
  /// Share of white (1: full scale, clipped) that a pixel shows, with noise. `noise_key`: unlike
  /// for each pixel and frame.
  [[nodiscard]] float expose(float radiance, double exposure_s, double gain,
                             std::uint64_t noise_key) const;

 private:
  double full_well_;
  double read_noise_;
  double electrons_per_s_;
  float loss_;
  float middle_x_;
  float middle_y_;
  float corner2_;
};

/// sRGB: level (0 to 1) that stands for a share of white.
float coded(float linear);

}  // namespace topoloc::rendering

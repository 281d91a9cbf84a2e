// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/sensor.hpp"

#include "topoloc/world/random.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::rendering {

Sensor::Sensor(const CameraSpec& spec)
    : full_well_(spec.full_well_electrons),
      read_noise_(spec.read_noise_electrons),
      electrons_per_s_(spec.electrons_per_s),
      loss_(static_cast<float>(spec.vignetting)),
      middle_x_(0.5F * static_cast<float>(spec.calibration.pinhole.width_px - 1)),
      middle_y_(0.5F * static_cast<float>(spec.calibration.pinhole.height_px - 1)),
      corner2_(std::max(middle_x_ * middle_x_ + middle_y_ * middle_y_, 1.0F)) {}

float Sensor::vignetting(int row, int column) const {
  const float x = static_cast<float>(column) - middle_x_;
  const float y = static_cast<float>(row) - middle_y_;
  return 1.0F - loss_ * (x * x + y * y) / corner2_;
}

float Sensor::expose(float radiance, double exposure_s, double gain,
                     std::uint64_t noise_key) const {
  const double mean =
      std::min(static_cast<double>(radiance) * exposure_s * electrons_per_s_, full_well_);
  // Photons come by Poisson's law, close to the normal one where it is to be seen.
  const double deviation = std::sqrt(mean + read_noise_ * read_noise_);
  const double electrons = mean + deviation * world::Random(noise_key).normal();
  return static_cast<float>(std::clamp(gain * electrons / full_well_, 0.0, 1.0));
}

float coded(float linear) {
  return linear <= 0.0031308F ? 12.92F * linear : 1.055F * std::pow(linear, 1.0F / 2.4F) - 0.055F;
}

}  // namespace topoloc::rendering

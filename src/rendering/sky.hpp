// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/camera_renderer.hpp"

#include <Eigen/Core>

namespace topoloc::rendering {

/// Light as it comes from above. Unit of all light here: irradiance of full day light (some
/// 100 klx); a white surface in it has radiance 1.
struct Illumination {
  Eigen::Vector3d to_sun = Eigen::Vector3d::UnitZ();
  double sun = 0.0;          ///< irradiance at right angles; 0: no sun, no shadows
  double zenith = 0.0;       ///< radiance of the clear sky there
  double horizon = 0.0;      ///< and near the horizon
  double glow = 0.0;         ///< of the sky above where the sun has set
  double clouds = 0.0;       ///< radiance of clouds
  double cloud_cover = 0.0;  ///< share of the sky
  bool lamps_lit = false;    ///< street lamps, head lamps, windows
};

/// Of a day: each has its own sun and clouds.
Illumination illumination(Light light, std::uint64_t seed);

/// The sky of a drive.
class Sky {
 public:
  Sky(const Illumination& light, std::uint64_t seed);

  /// Radiance with clouds, as a camera sees it; below the horizon that of the horizon.
  [[nodiscard]] float radiance(const Eigen::Vector3d& direction) const;
  /// Without clouds' details, for what it lights.
  [[nodiscard]] float mean_radiance(const Eigen::Vector3d& direction) const;
  /// Irradiance of level ground in the open, without the sun.
  [[nodiscard]] float irradiance() const { return irradiance_; }

 private:
  Illumination light_;
  std::uint32_t seed_ = 0;
  float irradiance_ = 0.0F;
};

}  // namespace topoloc::rendering

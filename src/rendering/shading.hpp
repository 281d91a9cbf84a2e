// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/raycaster.hpp"

#include "rendering/ambient.hpp"
#include "rendering/head_lamps.hpp"
#include "rendering/lamps.hpp"
#include "rendering/sky.hpp"

#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>

namespace topoloc::rendering {

/// Samples of one pixel that fell on one surface.
struct Patch {
  std::span<const Hit> hits;
  std::span<const Eigen::Vector3d> directions;  ///< of their rays, unit length
  double pixel_rad = 0.0;                       ///< angle that a pixel subtends
};

/// Light that surfaces and sky send to the camera.
class Shading {
 public:
  Shading(const Raycaster& raycaster, Light light, std::uint64_t seed);

  /// Before each frame.
  void begin_frame(const std::optional<HeadLamps>& head_lamps);
  /// Mean radiance of the samples.
  [[nodiscard]] float radiance(const Patch& patch);
  [[nodiscard]] const Sky& sky() const { return sky_; }
  [[nodiscard]] const Illumination& light() const { return light_; }

 private:
  [[nodiscard]] float sunlit_share(std::span<const Hit> hits) const;
  [[nodiscard]] float beside_moving(const Hit& hit) const;
  [[nodiscard]] float mirrored(const Hit& hit, const Eigen::Vector3d& direction,
                               float ambient) const;

  const Raycaster* raycaster_;
  Illumination light_;
  Sky sky_;
  Lamps lamps_;
  Ambient ambient_;
  std::optional<HeadLamps> head_lamps_;
};

}  // namespace topoloc::rendering

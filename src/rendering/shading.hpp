// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/raycaster.hpp"

#include "rendering/ambient.hpp"
#include "rendering/head_lamps.hpp"
#include "rendering/lamps.hpp"
#include "rendering/patch.hpp"
#include "rendering/sky.hpp"

#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>

namespace topoloc::rendering {

/// Light that surfaces and sky send to the camera.
class Shading {
 public:
  Shading(const Raycaster& raycaster, Light light, std::uint64_t seed);

  /// Before each frame.
  void begin_frame(const std::optional<HeadLamps>& head_lamps);
  /// Ray from a surface to the sun, another point of its disc for each sample; nothing if the
  /// surface turns away from it, or there is none.
  [[nodiscard]] std::optional<Ray> to_sun(const Hit& hit, std::size_t sample) const;
  /// Light that reaches a patch from all sides.
  [[nodiscard]] float around(const Patch& patch);
  /// Lets lamps shine on patches that lie close together.
  void light_up(std::span<Patch> patches);
  /// Mean radiance of the samples of a patch that has all its light.
  [[nodiscard]] float radiance(const Patch& patch) const;
  [[nodiscard]] const Sky& sky() const { return sky_; }
  [[nodiscard]] const Illumination& light() const { return light_; }

 private:
  [[nodiscard]] float beside_moving(const Hit& hit) const;
  [[nodiscard]] float mirrored(const Hit& hit, const Eigen::Vector3d& direction,
                               float ambient) const;

  const Raycaster* raycaster_;
  Illumination light_;
  Eigen::Matrix3d sun_frame_;
  Sky sky_;
  Lamps lamps_;
  Ambient ambient_;
  std::optional<HeadLamps> head_lamps_;
};

}  // namespace topoloc::rendering

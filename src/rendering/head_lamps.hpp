// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/raycaster.hpp"

#include <Eigen/Core>

namespace topoloc::rendering {

/// The ego vehicle's low beam, during one frame.
class HeadLamps {
 public:
  explicit HeadLamps(const RigidTransform& T_world_lamps)
      : T_world_lamps_(T_world_lamps), T_lamps_world_(T_world_lamps.inverse()) {}

  struct Light {
    float irradiance = 0.0F;  ///< of the surface
    float beam = 0.0F;        ///< at right angles to the light
  };
  [[nodiscard]] Light at(const Raycaster& raycaster, const Hit& hit) const;
  /// Angle between the light that meets a point and the ray of sight that does.
  [[nodiscard]] double observation_rad(const Hit& hit, const Eigen::Vector3d& sight) const;

 private:
  RigidTransform T_world_lamps_;
  RigidTransform T_lamps_world_;
};

/// How many times as bright as white a retro-reflector looks that throws `1` back, seen
/// `observation_rad` off the light.
float retro_gain(double observation_rad);

}  // namespace topoloc::rendering

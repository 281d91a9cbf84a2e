// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/raycaster.hpp"

#include "rendering/patch.hpp"

#include <span>

#include <Eigen/Core>

namespace topoloc::rendering {

/// The ego vehicle's low beam, during one frame.
class HeadLamps {
 public:
  explicit HeadLamps(const RigidTransform& T_world_lamps)
      : T_world_lamps_(T_world_lamps), T_lamps_world_(T_world_lamps.inverse()) {}

  /// Sets what they add to patches that lie close together.
  void shine(const Raycaster& raycaster, std::span<Patch> patches) const;
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

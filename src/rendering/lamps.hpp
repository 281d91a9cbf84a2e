// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/raycaster.hpp"

#include "rendering/patch.hpp"

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

namespace topoloc::rendering {

/// The world's lamps, found by place.
class Lamps {
 public:
  /// `lit`: those too that are not always on.
  Lamps(const Raycaster& raycaster, bool lit);

  /// Sets the irradiance of patches that lie close together. Shadows of the strongest few only.
  void shine(std::span<Patch> patches) const;

 private:
  struct Shadow;
  void shine(Patch& patch, std::vector<Shadow>& shadows) const;
  [[nodiscard]] std::span<const std::uint32_t> near(const Eigen::Vector3d& point_m) const;

  const Raycaster* raycaster_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

}  // namespace topoloc::rendering

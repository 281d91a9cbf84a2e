// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/raycaster.hpp"

#include "rendering/sky.hpp"
#include "rendering/value_cache.hpp"

#include <cstdint>

#include <Eigen/Core>

namespace topoloc::rendering {

/// Of what surrounds a road, on the average.
inline constexpr float kBounceAlbedo = 0.22F;

/// Light that comes from all sides: from the parts of the sky that are to be seen, and once
/// reflected from what the sun and the sky shine on. No sampling noise: it is computed at nodes
/// some 0.5 m apart, each once, and interpolated. What moves is left out.
class Ambient {
 public:
  Ambient(const Raycaster& raycaster, const Illumination& light, const Sky& sky);

  /// Irradiance. `footprint_m`: length of what is looked at; where it is long, nodes lie farther
  /// apart, else each look at a meadow far off would make nodes of its own.
  [[nodiscard]] float at(const Hit& hit, double footprint_m);
  /// Between frames, while no thread uses it.
  void make_room() { cache_.make_room(); }

 private:
  enum class Gather : std::uint8_t { kHemisphere, kSphere };

  [[nodiscard]] float on_facet(const Hit& hit, double footprint_m);
  [[nodiscard]] float in_plant(const Hit& hit, double footprint_m);
  [[nodiscard]] float on_vehicle(const Hit& hit);
  template <typename Where>
  [[nodiscard]] float remembered(std::uint64_t key, Gather gather, const Where& where);
  [[nodiscard]] float in_space(const Eigen::Vector3d& point_m, double size_m, Gather gather);
  /// What one set of rays finds.
  struct Gathered {
    float irradiance = 0.0F;
    int bright = 0;  ///< rays that met the sky, or something in the sun
  };
  [[nodiscard]] float gathered(const Eigen::Vector3d& from_m, const Eigen::Vector3d& normal,
                               Gather gather) const;
  /// `R`: to the rays' axes, z along the normal.
  [[nodiscard]] Gathered gathered_once(const Eigen::Vector3d& from_m, const Eigen::Matrix3d& R,
                                       Gather gather) const;

  const Raycaster* raycaster_;
  Illumination light_;
  const Sky* sky_;
  ValueCache cache_;
};

}  // namespace topoloc::rendering

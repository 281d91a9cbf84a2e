// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/raycaster.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <embree3/rtcore.h>
#include <span>

namespace topoloc::rendering {

inline RTCRay embree_ray(const Ray& ray) {
  RTCRay result{};
  result.org_x = static_cast<float>(ray.origin_m.x());
  result.org_y = static_cast<float>(ray.origin_m.y());
  result.org_z = static_cast<float>(ray.origin_m.z());
  result.dir_x = static_cast<float>(ray.direction.x());
  result.dir_y = static_cast<float>(ray.direction.y());
  result.dir_z = static_cast<float>(ray.direction.z());
  result.tfar = static_cast<float>(ray.max_m);
  result.mask = 0xFFFFFFFFU;
  return result;
}

inline constexpr std::size_t kPacket = 16;

/// Up to sixteen rays, side by side.
struct Packet {
  explicit Packet(std::span<const Ray> from) {
    RTCRay16& to = rays.ray;
    for (std::size_t i = 0; i < kPacket && !from.empty(); ++i) {
      // Empty places hold a ray too, though not a valid one: bounds are those of all.
      const RTCRay ray = embree_ray(from[std::min(i, from.size() - 1)]);
      valid[i] = i < from.size() ? -1 : 0;
      to.org_x[i] = ray.org_x;
      to.org_y[i] = ray.org_y;
      to.org_z[i] = ray.org_z;
      to.dir_x[i] = ray.dir_x;
      to.dir_y[i] = ray.dir_y;
      to.dir_z[i] = ray.dir_z;
      to.tfar[i] = ray.tfar;
      to.mask[i] = ray.mask;
      rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
  }
  alignas(64) std::array<int, kPacket> valid{};
  alignas(64) RTCRayHit16 rays{};
};

}  // namespace topoloc::rendering

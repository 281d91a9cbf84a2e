// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/head_lamps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace topoloc::rendering {
namespace {

// Two lamps of 20,000 candela, in units of full day light (100 klx) at 1 m.
constexpr double kPeak = 0.4;
constexpr double kBeamReach_m = 150.0;
constexpr double kDegree = 0.017453292519943295;

/// Low beam: bright below its cut-off 0.6 degrees under the horizon, little light above.
double pattern(const Eigen::Vector3d& p) {
  const double azimuth = std::atan2(p.y(), p.x()) / kDegree;
  const double elevation = std::atan2(p.z(), p.head<2>().norm()) / kDegree;
  const double across = std::exp(-azimuth * azimuth / (22.0 * 22.0));
  const double above = 1.0 / (1.0 + std::exp((elevation + 0.6) / 0.2));
  const double down = std::min(elevation + 1.2, 0.0);
  const double foreground = std::exp(-down * down / (6.0 * 6.0));
  return across * (0.015 + above * foreground);
}

}  // namespace

void HeadLamps::shine(const Raycaster& raycaster, std::span<Patch> patches) const {
  std::vector<Ray> rays;
  std::vector<Patch*> lit;
  for (Patch& patch : patches) {
    const Eigen::Vector3d p = T_lamps_world_ * patch.hit.point_m;
    const double distance_m = p.norm();
    if (p.x() <= 0.1 || distance_m > kBeamReach_m) {
      continue;
    }
    const Eigen::Vector3d from_m = off_surface(patch.hit);
    const Eigen::Vector3d to_lamps = T_world_lamps_.p - from_m;
    const double length_m = to_lamps.norm();
    const double cosine = patch.hit.normal.dot(to_lamps) / length_m;
    if (cosine > 0.0) {
      const double beam = kPeak * pattern(p) / (distance_m * distance_m);
      patch.beam = static_cast<float>(beam);
      patch.head_lamps = static_cast<float>(beam * cosine);
      rays.push_back({from_m, to_lamps / length_m, length_m});
      lit.push_back(&patch);
    }
  }
  std::vector<std::uint8_t> blocked(rays.size());
  raycaster.blocked(rays, blocked);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (blocked[i] != 0) {
      lit[i]->beam = 0.0F;
      lit[i]->head_lamps = 0.0F;
    }
  }
}

double HeadLamps::observation_rad(const Hit& hit, const Eigen::Vector3d& sight) const {
  const Eigen::Vector3d beam = (hit.point_m - T_world_lamps_.p).normalized();
  return std::acos(std::clamp(beam.dot(sight), -1.0, 1.0));
}

// Coefficients of retro-reflection of sheeting, 250 cd/lx/m2, over the 1/pi of white; falls with
// the angle at which one looks.
float retro_gain(double observation_rad) {
  constexpr double kStraight = 800.0;
  const double angle = observation_rad / (0.5 * kDegree);
  return static_cast<float>(kStraight / (1.0 + angle * angle));
}

}  // namespace topoloc::rendering

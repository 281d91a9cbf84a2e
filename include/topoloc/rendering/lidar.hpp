// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/rendering/raycaster.hpp"

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

namespace topoloc::rendering {

/// A spinning LiDAR of a mapping vehicle.
struct LidarSpec {
  int beams = 64;
  double lowest_rad = -0.44;  ///< elevation of the lowest beam
  double highest_rad = 0.26;
  int columns = 1800;     ///< directions per turn
  double rate_hz = 10.0;  ///< turns
  double range_noise_m = 0.01;
  double max_range_m = 120.0;
  double beam_divergence_rad = 0.002;
};

struct LidarPoint {
  Eigen::Vector3f p_lidar_m = Eigen::Vector3f::Zero();  ///< in the scanner's frame at its own time
  float intensity = 0.0F;  ///< 0 to 1: reflectance x cosine of incidence, calibrated for distance
  std::int32_t after_ns = 0;  ///< since the turn began
  bool moving = false;        ///< hit a moving vehicle
};

/// One turn, clockwise seen from above and from behind the scanner (-x) to behind it.
/// `T_world_lidar` at a time [s] since the turn began; frame: x forward, y left, z up.
/// Deterministic in `key` whatever the number of threads (0: one per usable CPU). Points come by
/// column, then beam (lowest first); misses and drop-outs (dark, far, specular) are left out.
/// Throws std::invalid_argument for a spec that no scanner has.
std::vector<LidarPoint> scan(const Raycaster& raycaster, const LidarSpec& spec,
                             const std::function<RigidTransform(double)>& T_world_lidar,
                             std::uint64_t key, int threads = 0);

}  // namespace topoloc::rendering

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/evaluation/trajectory.hpp"
#include "topoloc/rendering/lidar.hpp"
#include "topoloc/simulation/cloud_files.hpp"
#include "topoloc/simulation/ego.hpp"
#include "topoloc/simulation/smooth_noise.hpp"
#include "topoloc/world/world.hpp"

#include <cstdint>
#include <functional>

namespace topoloc::simulation {

/// A pose that is wrong by a smooth error: independent per axis, slowly varying in time.
class PoseError {
 public:
  struct Spec {
    double position_m = 0.0;  ///< per axis, one standard deviation
    double rotation_rad = 0.0;
    double correlation_s = 10.0;
  };
  PoseError(const Spec& spec, std::uint64_t key);
  /// Errors in the axes of the world (position) and of the body (rotation).
  [[nodiscard]] RigidTransform disturbed(const RigidTransform& T_world_body, double time_s) const;

 private:
  Spec spec_;
  SmoothNoise3 position_;
  SmoothNoise3 rotation_;
};

/// How the cloud of a mapping drive is made.
struct SurveySpec {
  rendering::LidarSpec lidar;
  double spacing_m = 1.0;  ///< of scans along the way, on average; no more than the scanner turns
  /// Of a survey-grade GNSS/INS after post-processing: 2.6 cm in all.
  PoseError::Spec poses{.position_m = 0.015, .rotation_rad = 0.00035, .correlation_s = 15.0};
  /// Points are thinned to one in a cube, of near_edge_m up to near_m from the scanner, of
  /// middle_edge_m up to middle_m, of far_edge_m beyond.
  double near_m = 9.0;
  double near_edge_m = 0.08;
  double middle_m = 25.0;
  double middle_edge_m = 0.13;
  double far_edge_m = 0.3;
};

struct SurveyCounts {
  std::uint64_t scans = 0;
  std::uint64_t returns = 0;
  std::uint64_t points = 0;         ///< kept
  std::uint64_t moving_points = 0;  ///< of these, on vehicles that drove: traces in the cloud
};

/// Scans the world along a drive. `progress`: share done.
SurveyCounts survey(rendering::Raycaster& raycaster, const Ego& ego, const world::Visit& visit,
                    const RigidTransform& T_vehicle_lidar, const SurveySpec& spec,
                    std::int64_t begin_ns, std::uint64_t key,
                    const std::function<void(const SurveyPoint&)>& write,
                    const std::function<void(double)>& progress);

/// A trajectory as a mapping-grade GNSS/INS without post-processing gives it.
evaluation::Trajectory disturbed(const evaluation::Trajectory& truth, const PoseError::Spec& spec,
                                 std::uint64_t key);

}  // namespace topoloc::simulation

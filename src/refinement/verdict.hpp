// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/pose_refiner.hpp"
#include "topoloc/refinement/pose_graph.hpp"
#include "topoloc/refinement/trajectory_refiner.hpp"

#include "refinement/keyframes.hpp"

#include <vector>

namespace topoloc::refinement {

/// A solved graph, as the verdicts need it.
struct SolvedDrive {
  const std::vector<Keyframe>& keyframes;
  const std::vector<RigidTransform>& poses;
  const PoseGraph& graph;
  std::size_t stretches_tried;
  std::size_t stretches_registered;  ///< with a registration in the graph
  BestLens lens;                     ///< for all windows together
  const RigidTransform& T_imu_cam;
  const PinholeCamera& camera;
};

/// Judges each keyframe (M10). Throws std::runtime_error with a diagnosis where the drive as a
/// whole does not fit the cloud: a map made of it would be wrong with confidence.
std::vector<mapping::RefinedPose> judge(const SolvedDrive& drive, const RefinementConfig& config);

}  // namespace topoloc::refinement

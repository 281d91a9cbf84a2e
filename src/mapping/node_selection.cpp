// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/node_selection.hpp"

#include "topoloc/geometry/so3.hpp"

#include <optional>
#include <stdexcept>

namespace topoloc::mapping {

bool is_used(std::size_t frame, FrameParity parity) {
  return parity == FrameParity::kAll || (frame % 2 == 0) == (parity == FrameParity::kEven);
}

Selection select_nodes(std::span<const std::int64_t> times_ns,
                       const evaluation::Trajectory& trajectory, const SelectionConfig& config) {
  if (!(config.every_m > 0.0) || !(config.every_rad > 0.0)) {
    throw std::invalid_argument("node spacing must be positive");
  }
  Selection selection;
  std::optional<RigidTransform> previous;
  for (std::size_t frame = 0; frame < times_ns.size(); ++frame) {
    if (!is_used(frame, config.frames)) {
      ++selection.frames_of_other_parity;
      continue;
    }
    const auto pose = evaluation::pose_at(trajectory, times_ns[frame], config.max_pose_gap_ns);
    if (!pose) {
      ++selection.frames_without_pose;
      continue;
    }
    const double step_m = previous ? (pose->p - previous->p).norm() : 0.0;
    selection.travelled_m += step_m;
    previous = pose;
    if (!selection.nodes.empty()) {
      const RigidTransform& last = selection.nodes.back().T_world_imu;
      // Half a step early: the next frame would be further from the spacing than this one.
      const bool far = (pose->p - last.p).norm() + 0.5 * step_m >= config.every_m;
      const bool turned = so3::log(last.R.transpose() * pose->R).norm() >= config.every_rad;
      if (!far && !turned) {
        continue;
      }
    }
    selection.nodes.push_back({.frame = frame, .time_ns = times_ns[frame], .T_world_imu = *pose});
  }
  return selection;
}

}  // namespace topoloc::mapping

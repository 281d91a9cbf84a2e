// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/geometry/so3.hpp"
#include "topoloc/simulation/survey.hpp"
#include "topoloc/world/random.hpp"

namespace topoloc::simulation {

PoseError::PoseError(const Spec& spec, std::uint64_t key)
    : spec_(spec),
      position_(world::key(key, {1}), spec.correlation_s),
      rotation_(world::key(key, {2}), spec.correlation_s) {}

RigidTransform PoseError::disturbed(const RigidTransform& T_world_body, double time_s) const {
  const Eigen::Vector3d turn = spec_.rotation_rad * rotation_.value(time_s);
  return {T_world_body.R * so3::exp(turn),
          T_world_body.p + spec_.position_m * position_.value(time_s)};
}

evaluation::Trajectory disturbed(const evaluation::Trajectory& truth, const PoseError::Spec& spec,
                                 std::uint64_t key) {
  const PoseError error(spec, key);
  evaluation::Trajectory result = truth;
  for (evaluation::StampedPose& pose : result) {
    const double time_s = static_cast<double>(pose.time_ns - truth.front().time_ns) * 1e-9;
    pose.T_world_imu = error.disturbed(pose.T_world_imu, time_s);
  }
  return result;
}

}  // namespace topoloc::simulation

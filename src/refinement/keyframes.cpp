// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/keyframes.hpp"

#include <algorithm>
#include <stdexcept>

namespace topoloc::refinement {
namespace {

DeadReckoning reckon(const drive::Drive& drive, const PoseKnowledge& knowledge) {
  if (knowledge.initial_pose) {
    return dead_reckon(drive, 0.0, *knowledge.initial_pose);
  }
  // A trajectory may have begun long before, in another place.
  const auto during = std::find_if(knowledge.trajectory->begin(), knowledge.trajectory->end(),
                                   [&](const evaluation::StampedPose& pose) {
                                     return pose.time_ns >= drive.imu.front().time_ns;
                                   });
  const evaluation::StampedPose& first =
      during == knowledge.trajectory->end() ? knowledge.trajectory->front() : *during;
  const double start_s =
      std::max(0.0, evaluation::kSecondsPerNs *
                        static_cast<double>(first.time_ns - drive.imu.front().time_ns));
  return dead_reckon(drive, start_s, first.T_world_imu);
}

/// Of the filter's last tick until then.
double tilt_std_at(const DeadReckoning& odometry, std::int64_t time_ns) {
  const auto after = std::upper_bound(
      odometry.filtered.begin() + 1, odometry.filtered.end(), time_ns,
      [](std::int64_t t, const evaluation::StampedPose& pose) { return t < pose.time_ns; });
  return odometry.tilt_std_rad[static_cast<std::size_t>(after - odometry.filtered.begin()) - 1];
}

void choose_views(std::vector<Keyframe>& keyframes, const RefinementConfig& config) {
  keyframes.front().is_view = true;
  double since_m = 0.0;
  for (std::size_t k = 1; k < keyframes.size(); ++k) {
    since_m += step_m(keyframes, k);
    if (since_m + 0.5 * step_m(keyframes, k) >=
        config.window.view_m) {  // the next would be farther off
      keyframes[k].is_view = true;
      since_m = 0.0;
    }
  }
}

}  // namespace

std::vector<Keyframe> choose_keyframes(const drive::Drive& drive, const PoseKnowledge& knowledge,
                                       const drive::FrameLog& frames,
                                       const RefinementConfig& config) {
  const DeadReckoning odometry = reckon(drive, knowledge);
  std::vector<Keyframe> keyframes;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!mapping::is_used(i, config.frames)) {
      continue;
    }
    const std::int64_t time_ns = frames.time_ns(i);
    const auto T_odometry = evaluation::pose_at(odometry.motion, time_ns, kMaxPoseGap_ns);
    const auto T_filtered = evaluation::pose_at(odometry.filtered, time_ns, kMaxPoseGap_ns);
    if (!T_odometry || !T_filtered ||
        (!keyframes.empty() &&
         (T_odometry->p - keyframes.back().T_odometry.p).norm() < config.keyframe_m)) {
      continue;
    }
    std::optional<RigidTransform> T_prior;
    if (knowledge.trajectory) {
      T_prior = evaluation::pose_at(*knowledge.trajectory, time_ns, kMaxPoseGap_ns);
      if (!T_prior) {
        continue;
      }
    }
    keyframes.push_back({i, time_ns, *T_odometry, T_filtered->R.row(2).transpose(),
                         tilt_std_at(odometry, time_ns), T_prior});
  }
  if (keyframes.empty()) {
    throw std::runtime_error(
        drive.dir.string() +
        ": no camera frame has both odometry (can.log) and a pose to start from");
  }
  choose_views(keyframes, config);
  return keyframes;
}

}  // namespace topoloc::refinement

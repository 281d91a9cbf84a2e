// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/refinement/trajectory_refiner.hpp"

#include <cstdint>
#include <vector>

namespace topoloc::refinement {

/// Poses further apart are not interpolated between.
inline constexpr std::int64_t kMaxPoseGap_ns = 500'000'000;

/// A frame whose pose is looked for.
struct Keyframe {
  std::size_t frame = 0;  ///< order number in the camera log
  std::int64_t time_ns = 0;
  RigidTransform T_odometry;  ///< by dead reckoning: what counts is the motion between keyframes
  Eigen::Vector3d up_imu =
      Eigen::Vector3d::UnitZ();  ///< the world's z axis in the vehicle's axes, by inertia
  double up_std_rad = 0.0;
  std::optional<RigidTransform> T_prior;  ///< as the trajectory given has it
  bool is_view = false;                   ///< its image is compared with the cloud
};

/// Way from the keyframe before, by odometry [m].
inline double step_m(const std::vector<Keyframe>& keyframes, std::size_t k) {
  return (keyframes[k].T_odometry.p - keyframes[k - 1].T_odometry.p).norm();
}

/// Dead-reckons the drive and takes a frame every `keyframe_m`, as a view the one that comes
/// closest to `window.view_m` behind the last. Throws std::runtime_error where no
/// frame has odometry and, if a trajectory is given, a pose in it.
std::vector<Keyframe> choose_keyframes(const drive::Drive& drive, const PoseKnowledge& knowledge,
                                       const drive::FrameLog& frames,
                                       const RefinementConfig& config);

}  // namespace topoloc::refinement

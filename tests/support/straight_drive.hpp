// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/estimator.hpp"

#include "support/camera_scene.hpp"

namespace topoloc::test {

inline constexpr std::int64_t kDriveStart_ns = 1'700'000'000'000'000'000;

/// A car driving straight ahead at constant speed along x, for tests of the estimator's behaviour.
struct StraightDrive {
  double speed_mps = 8.0;
  estimation::CameraModel camera = forward_camera();

  [[nodiscard]] static std::int64_t at(double seconds) {
    return kDriveStart_ns + static_cast<std::int64_t>(std::llround(seconds * 1e9));
  }
  [[nodiscard]] RigidTransform pose(double seconds) const {
    return {Eigen::Matrix3d::Identity(), {speed_mps * seconds, 0.0, 0.0}};
  }
  [[nodiscard]] static estimation::ImuSample imu(double seconds) {
    return {.time_ns = at(seconds),
            .specific_force_mps2 = {0.0, 0.0, 9.81},
            .angular_rate_radps = Eigen::Vector3d::Zero()};
  }
  [[nodiscard]] estimation::SpeedSample speed(double seconds) const {
    return {.time_ns = at(seconds), .speed_mps = speed_mps};
  }
  /// Matches of a frame at that time; `offset_m` shifts the map, so that they contradict.
  void matches(double seconds, int count, estimation::MapMatchSet& set,
               const Eigen::Vector3d& offset_m = Eigen::Vector3d::Zero()) const {
    Random random(static_cast<std::uint64_t>(std::llround(seconds * 1000.0)) + 1);
    RigidTransform T = pose(seconds);
    T.p += offset_m;
    fill_matches(T, camera, count, 1.0, random, set);
    set.frame_time_ns = at(seconds);
  }
};

}  // namespace topoloc::test

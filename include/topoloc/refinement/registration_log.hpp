// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/refinement/registration.hpp"

#include <cstdint>
#include <filesystem>
#include <span>

namespace topoloc::refinement {

/// A registration that was tried, whatever came of it.
struct RegistrationAttempt {
  std::int64_t time_ns = 0;  ///< of the keyframe
  int pass = 0;              ///< over the drive, from 0
  RigidTransform T_prior;    ///< T_world_imu that it started from
  Registration found;
  bool significant = false;
  bool accepted =
      false;  ///< entered the pose graph: significant and not contradicted by a surer one
  double seconds = 0.0;  ///< spent on it; images and the cloud's views included for matches
};

/// Writes them as CSV, a line each after a header: time_ns, pass, route (matches or correlation),
/// prior_ and found_ x_m, y_m, z_m, qx, qy, qz, qw of T_world_imu, std_ of the pose found in
/// vehicle axes (roll, pitch, yaw [rad], x, y, z [m]), score, significance, significant and
/// accepted (0 or 1), seconds. Throws std::runtime_error that names a file that cannot be written.
void write_registrations(const std::filesystem::path& file,
                         std::span<const RegistrationAttempt> attempts);

}  // namespace topoloc::refinement

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/registration_log.hpp"

#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string>

#include <fmt/core.h>

namespace topoloc::refinement {
namespace {

std::string pose_columns(const RigidTransform& T) {
  const Eigen::Quaterniond q = T.quaternion();
  return fmt::format("{:.6f},{:.6f},{:.6f},{:.9f},{:.9f},{:.9f},{:.9f}", T.p.x(), T.p.y(), T.p.z(),
                     q.x(), q.y(), q.z(), q.w());
}

}  // namespace

void write_registrations(const std::filesystem::path& file,
                         std::span<const RegistrationAttempt> attempts) {
  std::ofstream out(file);
  out << "time_ns,pass,route,"
         "prior_x_m,prior_y_m,prior_z_m,prior_qx,prior_qy,prior_qz,prior_qw,"
         "found_x_m,found_y_m,found_z_m,found_qx,found_qy,found_qz,found_qw,"
         "std_roll_rad,std_pitch_rad,std_yaw_rad,std_x_m,std_y_m,std_z_m,"
         "score,significance,significant,accepted,seconds\n";
  for (const RegistrationAttempt& attempt : attempts) {
    const Registration& found = attempt.found;
    out << fmt::format("{},{},{},{},{},", attempt.time_ns, attempt.pass, name(found.route),
                       pose_columns(attempt.T_prior), pose_columns(found.T_world_imu));
    for (int i = 0; i < 6; ++i) {
      out << fmt::format("{:.6f},", std::sqrt(found.covariance(i, i)));
    }
    out << fmt::format("{:.6f},{:.3f},{:d},{:d},{:.4f}\n", found.score, found.significance,
                       attempt.significant, attempt.accepted, attempt.seconds);
  }
  out.close();
  if (!out) {
    throw std::runtime_error(file.string() + ": cannot be written");
  }
}

}  // namespace topoloc::refinement

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/driven_motion.hpp"

#include <cstddef>

namespace topoloc::refinement {

evaluation::Trajectory driven_motion(const evaluation::Trajectory& filtered,
                                     const std::vector<Eigen::Vector3d>& v_imu_mps,
                                     const Eigen::Vector3d& forward_imu, const GyroIntegral& gyro) {
  constexpr double kSlow_mps = 0.5;
  evaluation::Trajectory result;
  for (std::size_t i = 0; i < filtered.size(); ++i) {
    if (i == 0) {
      result.push_back(filtered[0]);
      continue;
    }
    const double seconds = evaluation::kSecondsPerNs *
                           static_cast<double>(filtered[i].time_ns - filtered[i - 1].time_ns);
    RigidTransform step = filtered[i - 1].T_world_imu.inverse() * filtered[i].T_world_imu;
    step.R = gyro.between(filtered[i - 1].time_ns, filtered[i].time_ns);
    const Eigen::Vector3d driven = 0.5 * seconds * (v_imu_mps[i - 1] + step.R * v_imu_mps[i]);
    if (v_imu_mps[i].norm() < kSlow_mps) {
      step.p = driven;
    } else {
      step.p = driven + forward_imu * forward_imu.dot(step.p - driven);
    }
    result.push_back({filtered[i].time_ns, result.back().T_world_imu * step});
  }
  return result;
}

}  // namespace topoloc::refinement

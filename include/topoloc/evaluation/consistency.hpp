// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/evaluation/trajectory.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

/// Does the estimator's covariance tell the truth about its errors?
namespace topoloc::evaluation {

/// Estimated pose with the covariance of its error, order (theta, p): R_true = R Exp(theta) in IMU
/// axes [rad], p_true = p + dp in world axes [m].
struct StateEstimate {
  std::int64_t time_ns = 0;
  RigidTransform T_world_imu;
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Reads time_ns, px py pz, qx qy qz qw and the upper triangle c00 to c55 from the states CSV of
/// topoloc-localise; columns are found by name, others are ignored.
/// Throws std::runtime_error "file:line: ..." on missing columns, values that are not finite
/// numbers, times that do not increase, and a file without rows.
std::vector<StateEstimate> read_states(const std::filesystem::path& path);

/// Normalised estimation error squared, e^T P^-1 e, over all steps.
struct Nees {
  int dof = 0;
  double mean = 0.0;  ///< ANEES; expected: dof
  /// Where the mean of this many *independent* steps lies with 95 % probability if the covariance
  /// is right. Errors of neighbouring steps are correlated, so a real drive scatters more.
  double lower = 0.0;
  double upper = 0.0;
  double inside_share = 0.0;  ///< steps inside their own 95 % ellipsoid; expected: 0.95
};

struct Consistency {
  std::size_t steps = 0;
  std::size_t outside_reference = 0;      ///< states without a reference pose: not judged
  std::size_t not_positive_definite = 0;  ///< covariances that cannot be inverted: not judged
  Nees attitude;                          ///< 3 degrees of freedom
  Nees position;                          ///< 3
  Nees pose;                              ///< 6
};

/// Judges the states from begin_ns on against the reference, interpolated to their stamps. All
/// shares are 0 if no step could be judged (steps = 0).
Consistency consistency(const Trajectory& reference, const std::vector<StateEstimate>& states,
                        std::int64_t begin_ns, std::int64_t max_gap_ns);

}  // namespace topoloc::evaluation

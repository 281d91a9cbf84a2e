// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/choice.hpp"

#include "topoloc/evaluation/chi_square.hpp"

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace topoloc::refinement {

std::vector<std::size_t> agreeing_with_the_surest(std::span<const Registration> registrations,
                                                  std::span<const RigidTransform> poses) {
  constexpr double kConfidence = 0.99;
  static const double kLimit = evaluation::chi_square_quantile(kConfidence, 6.0);
  // Many views together are not led astray by one, however sure that says it is.
  const auto surest = std::min_element(
      registrations.begin(), registrations.end(), [](const Registration& a, const Registration& b) {
        return a.route != b.route ? a.route == Route::kCorrelation
                                  : a.covariance.determinant() < b.covariance.determinant();
      });
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < registrations.size(); ++i) {
    const Registration& other = registrations[i];
    // The vehicle hardly turns from one to the next: deviations are taken in the same axes.
    const RigidTransform expected =
        surest->T_world_imu * poses[surest->keyframe].inverse() * poses[other.keyframe];
    const Vector6 off = motion_between(expected, other.T_world_imu);
    const Matrix6 S = surest->covariance + other.covariance;
    if (&other == &*surest || off.dot(S.ldlt().solve(off)) <= kLimit) {
      chosen.push_back(i);
    }
  }
  return chosen;
}

void share_errors(std::span<Registration> chosen, double stretch_m, double correlation_m) {
  const double stretches = stretch_m < correlation_m ? correlation_m / stretch_m : 1.0;
  for (Registration& registration : chosen) {
    const auto of_route =
        std::count_if(chosen.begin(), chosen.end(),
                      [&](const Registration& other) { return other.route == registration.route; });
    registration.shared_by = stretches * static_cast<double>(of_route);
  }
}

}  // namespace topoloc::refinement

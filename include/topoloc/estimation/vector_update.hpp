// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/manifold_prior.hpp"
#include "topoloc/estimation/state.hpp"

#include <cmath>

#include <Eigen/LU>

namespace topoloc::estimation {

/// A measurement of a few rows, linearised at a state: h(x) = z + H dx + N(0, R), where the ideal
/// measurement makes h zero.
template <int Rows>
struct VectorLinearisation {
  Eigen::Matrix<double, Rows, 1> z;
  Eigen::Matrix<double, Rows, kErrorDim> H;
  Eigen::Matrix<double, Rows, Rows> R;
};

enum class VectorVerdict {
  kAccepted,
  kInnovationTooLarge,  ///< chi-square test of the innovation failed; state untouched
  kNotFinite,           ///< numbers broke down; state untouched
};

struct VectorUpdateResult {
  VectorVerdict verdict = VectorVerdict::kAccepted;
  int iterations = 0;
  double test_ratio = 0.0;  ///< innovation chi-square over its gate; above 1 is rejected
};

/// Iterated update (L8) with a measurement of few rows, by the innovation form of the gain: the
/// inverse is Rows x Rows. `linearise` maps a NominalState to VectorLinearisation<Rows>.
///
/// `independent_share`, in (0, 1]: how much of an independent sample the measurement is worth,
/// since its error is correlated with that of the samples before. The gain takes R / share; the
/// gate asks whether this one sample is believable and takes R.
template <int Rows, typename Linearise>
VectorUpdateResult update_with_vector(const Linearise& linearise, double chi2_gate, NominalState& x,
                                      Covariance& P, double independent_share = 1.0) {
  constexpr int kMaxIterations = 3;
  constexpr double kConverged = 1e-9;  // squared norm of the step's effect on the state
  const NominalState x_bar = x;
  NominalState x_k = x_bar;
  VectorUpdateResult result;
  Eigen::Vector3d last_theta = Eigen::Vector3d::Zero();
  Covariance P_post;
  for (int k = 0; k < kMaxIterations; ++k) {
    const VectorLinearisation<Rows> m = linearise(x_k);
    const PriorAtIterate prior = prior_at_iterate(x_k, x_bar, P);
    const Eigen::Matrix<double, kErrorDim, Rows> PHt = prior.P * m.H.transpose();
    const Eigen::Matrix<double, Rows, Rows> HPHt = m.H * PHt;
    if (k == 0) {
      result.test_ratio = m.z.dot((HPHt + m.R).inverse() * m.z) / chi2_gate;
      if (!std::isfinite(result.test_ratio)) {
        result.verdict = VectorVerdict::kNotFinite;
        return result;
      }
      if (result.test_ratio > 1.0) {
        result.verdict = VectorVerdict::kInnovationTooLarge;
        return result;
      }
    }
    const Eigen::Matrix<double, kErrorDim, Rows> K =
        PHt * (HPHt + m.R / independent_share).inverse();
    // eq_x_tilde: dx = -K z - (I - K H) (J^k)^-1 (x_k boxminus x_bar)
    const ErrorVector dx = -K * (m.z - m.H * prior.offset) - prior.offset;
    x_k = boxplus(x_k, dx);
    last_theta = dx.segment<3>(error_index::kTheta);
    P_post = prior.P - K * PHt.transpose();
    result.iterations = k + 1;
    if (dx.squaredNorm() < kConverged) {
      break;
    }
  }
  if (!all_finite(x_k) || !P_post.allFinite()) {
    result.verdict = VectorVerdict::kNotFinite;
    return result;
  }
  move_to_updated_state(last_theta, P_post);
  x = x_k;
  P = P_post;
  return result;
}

}  // namespace topoloc::estimation

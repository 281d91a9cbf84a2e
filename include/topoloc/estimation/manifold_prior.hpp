// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/state.hpp"

namespace topoloc::estimation {

/// The prior N(x_bar, P_bar) seen from the iterate x_k of an iterated update (L8, eq_P_).
///
/// J^k = blkdiag(J_r^-1(phi), I) with phi = Log(R_bar^T R_k) is the derivative of
/// (x_k boxplus dx) boxminus x_bar. Seen from x_k the prior has the covariance
/// P = (J^k)^-1 P_bar (J^k)^-T and its mean lies at -(J^k)^-1 (x_k boxminus x_bar).
struct PriorAtIterate {
  Covariance P;
  ErrorVector offset;  ///< (J^k)^-1 (x_k boxminus x_bar)
};

/// J^k itself, for tests and for readers.
Covariance prior_jacobian(const NominalState& x_k, const NominalState& x_bar);

PriorAtIterate prior_at_iterate(const NominalState& x_k, const NominalState& x_bar,
                                const Covariance& P_bar);

/// Carries a covariance over to the tangent space after the last step (errata of eq_result_state):
/// P <- G P G^T with G = blkdiag(J_r(dtheta), I), and makes it symmetric.
void move_to_updated_state(const Eigen::Vector3d& last_step_theta, Covariance& P);

}  // namespace topoloc::estimation

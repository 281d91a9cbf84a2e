// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/estimation/manifold_prior.hpp"

#include "topoloc/geometry/so3.hpp"

namespace topoloc::estimation {

using namespace error_index;

namespace {

/// P <- blkdiag(M, I) P blkdiag(M, I)^T.
void transform_rotation_block(const Eigen::Matrix3d& M, Covariance& P) {
  P.middleRows<3>(kTheta) = (M * P.middleRows<3>(kTheta)).eval();
  P.middleCols<3>(kTheta) = (P.middleCols<3>(kTheta) * M.transpose()).eval();
}

}  // namespace

Covariance prior_jacobian(const NominalState& x_k, const NominalState& x_bar) {
  const Eigen::Vector3d phi = so3::log(x_bar.R_world_imu.transpose() * x_k.R_world_imu);
  Covariance J = Covariance::Identity();
  J.block<3, 3>(kTheta, kTheta) = so3::right_jacobian_inverse(phi);
  return J;
}

PriorAtIterate prior_at_iterate(const NominalState& x_k, const NominalState& x_bar,
                                const Covariance& P_bar) {
  // J_r(phi) phi = phi, so (J^k)^-1 leaves the difference as it is.
  PriorAtIterate prior{P_bar, boxminus(x_k, x_bar)};
  transform_rotation_block(so3::right_jacobian(prior.offset.segment<3>(kTheta)), prior.P);
  return prior;
}

void move_to_updated_state(const Eigen::Vector3d& last_step_theta, Covariance& P) {
  transform_rotation_block(so3::right_jacobian(last_step_theta), P);
  P = 0.5 * (P + P.transpose()).eval();
}

}  // namespace topoloc::estimation

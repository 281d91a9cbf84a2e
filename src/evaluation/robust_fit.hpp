// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <Eigen/Core>

namespace topoloc::evaluation {

struct RobustFit {
  Eigen::VectorXd x;
  Eigen::VectorXd std;        ///< of x; correlated residuals inflate it
  double residual_std = 0.0;  ///< robust: scaled median of |b - A x|
};

/// Huber-weighted least squares of A x = b, by iterated reweighting, with a weak prior x = 0 +-
/// prior_std: directions that the data leave open keep the prior's standard deviation instead of
/// taking any value.
/// Rows have to be in time order: from the autocorrelation of their residuals follows how many of
/// them are as good as independent.
RobustFit robust_fit(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                     const Eigen::VectorXd& prior_std);

}  // namespace topoloc::evaluation

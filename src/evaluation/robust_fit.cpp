// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "robust_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace topoloc::evaluation {
namespace {

constexpr double kHuber = 1.345;          ///< 95 % efficient for normal residuals
constexpr double kMadToStd = 1.4826;      ///< for normal residuals
constexpr double kMinResidualStd = 1e-6;  ///< keeps noise-free data solvable
constexpr int kIterations = 30;

double robust_std(const Eigen::VectorXd& residuals) {
  Eigen::VectorXd magnitude = residuals.cwiseAbs();
  auto* middle = magnitude.data() + magnitude.size() / 2;
  std::nth_element(magnitude.data(), middle, magnitude.data() + magnitude.size());
  return std::max(kMadToStd * *middle, kMinResidualStd);
}

/// Number of neighbouring residuals that say the same thing: 1 + 2 sum of the autocorrelation up to
/// where it vanishes.
double correlation_length(const Eigen::VectorXd& residuals, double limit) {
  constexpr double kNoise = 0.05;
  const Eigen::VectorXd r = residuals.cwiseMin(limit).cwiseMax(-limit);
  const double power = r.squaredNorm();
  double length = 1.0;
  for (Eigen::Index lag = 1; lag < r.size() / 4 && power > 0.0; ++lag) {
    const double correlation = r.head(r.size() - lag).dot(r.tail(r.size() - lag)) / power;
    if (correlation < kNoise) {
      break;
    }
    length += 2.0 * correlation;
  }
  return length;
}

}  // namespace

RobustFit robust_fit(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                     const Eigen::VectorXd& prior_std) {
  const Eigen::MatrixXd prior = prior_std.cwiseAbs2().cwiseInverse().asDiagonal();
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(b.size());
  Eigen::MatrixXd information;
  RobustFit fit;
  fit.residual_std = robust_std(b);
  for (int i = 0; i < kIterations; ++i) {
    const double variance = fit.residual_std * fit.residual_std;
    information = A.transpose() * weights.asDiagonal() * A / variance;
    const Eigen::VectorXd gradient = A.transpose() * weights.cwiseProduct(b) / variance;
    fit.x = (information + prior).ldlt().solve(gradient);
    const Eigen::VectorXd residuals = b - A * fit.x;
    fit.residual_std = robust_std(residuals);
    const double limit = kHuber * fit.residual_std;
    weights = residuals.unaryExpr(
        [limit](double r) { return std::abs(r) <= limit ? 1.0 : limit / std::abs(r); });
  }
  const double length = correlation_length(b - A * fit.x, 3.0 * fit.residual_std);
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(prior.rows(), prior.cols());
  const Eigen::MatrixXd covariance = (information / length + prior).ldlt().solve(identity);
  fit.std = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return fit;
}

}  // namespace topoloc::evaluation

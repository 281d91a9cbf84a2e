// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

/// The chi-square distribution, to about ten digits for 1 to 1e6 degrees of freedom.
namespace topoloc::evaluation {

/// P(X <= x) for X chi-square distributed; dof > 0. Throws std::invalid_argument otherwise.
double chi_square_cdf(double x, double dof);

/// x with P(X <= x) = probability; 0 < probability < 1, dof > 0. Throws std::invalid_argument
/// otherwise.
double chi_square_quantile(double probability, double dof);

}  // namespace topoloc::evaluation

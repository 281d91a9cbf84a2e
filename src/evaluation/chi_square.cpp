// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/chi_square.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace topoloc::evaluation {
namespace {

constexpr int kMaxTerms = 100'000;
constexpr double kPrecision = 1e-15;

/// x^a e^-x / Gamma(a), the factor that both expansions share.
double gamma_front(double a, double x) { return std::exp(a * std::log(x) - x - std::lgamma(a)); }

/// Regularised lower incomplete gamma function by its power series: converges for x < a + 1.
double lower_gamma_series(double a, double x) {
  double term = 1.0 / a;
  double sum = term;
  for (int n = 1; n < kMaxTerms && term > sum * kPrecision; ++n) {
    term *= x / (a + n);
    sum += term;
  }
  return sum * gamma_front(a, x);
}

/// Regularised upper incomplete gamma function by its continued fraction (modified Lentz
/// evaluation): converges for x > a + 1.
double upper_gamma_fraction(double a, double x) {
  constexpr double kTiny = 1e-300;
  double b = x + 1.0 - a;
  double c = 1.0 / kTiny;
  double d = 1.0 / b;
  double fraction = d;
  for (int n = 1; n < kMaxTerms; ++n) {
    const double numerator = -n * (n - a);
    b += 2.0;
    d = numerator * d + b;
    d = 1.0 / (std::abs(d) < kTiny ? kTiny : d);
    c = b + numerator / c;
    c = std::abs(c) < kTiny ? kTiny : c;
    fraction *= c * d;
    if (std::abs(c * d - 1.0) < kPrecision) {
      break;
    }
  }
  return fraction * gamma_front(a, x);
}

}  // namespace

double chi_square_cdf(double x, double dof) {
  if (!(dof > 0.0) || std::isnan(x)) {
    throw std::invalid_argument("chi-square: the degrees of freedom must be positive");
  }
  if (x <= 0.0) {
    return 0.0;
  }
  const double a = 0.5 * dof;
  const double half_x = 0.5 * x;
  return half_x < a + 1.0 ? lower_gamma_series(a, half_x) : 1.0 - upper_gamma_fraction(a, half_x);
}

double chi_square_quantile(double probability, double dof) {
  if (!(probability > 0.0 && probability < 1.0)) {
    throw std::invalid_argument("chi-square: the probability must lie between 0 and 1");
  }
  double low = 0.0;
  double high = dof + 10.0;
  while (chi_square_cdf(high, dof) < probability) {
    high *= 2.0;
  }
  while (high - low > 1e-13 * high && high > std::numeric_limits<double>::min()) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) {
      break;
    }
    (chi_square_cdf(middle, dof) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace topoloc::evaluation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/chi_square.hpp"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

namespace topoloc::evaluation {
namespace {

TEST(ChiSquare, MatchesTheClosedFormOfTwoDegreesOfFreedom) {
  for (const double x : {1e-6, 0.1, 1.0, 5.0, 30.0}) {
    EXPECT_NEAR(chi_square_cdf(x, 2), 1.0 - std::exp(-0.5 * x), 1e-14);
  }
}

TEST(ChiSquare, MatchesTheClosedFormOfOneDegreeOfFreedom) {
  for (const double x : {1e-6, 0.1, 1.0, 5.0, 30.0}) {
    EXPECT_NEAR(chi_square_cdf(x, 1), std::erf(std::sqrt(0.5 * x)), 1e-13);
  }
}

TEST(ChiSquare, MatchesPublishedQuantiles) {
  EXPECT_NEAR(chi_square_quantile(0.95, 1), 3.841459, 1e-6);
  EXPECT_NEAR(chi_square_quantile(0.95, 3), 7.814728, 1e-6);
  EXPECT_NEAR(chi_square_quantile(0.95, 6), 12.591587, 1e-6);
  EXPECT_NEAR(chi_square_quantile(0.025, 100), 74.221927, 1e-6);
  EXPECT_NEAR(chi_square_quantile(0.975, 100), 129.561197, 1e-6);
}

TEST(ChiSquare, QuantileInvertsTheDistributionForManyDegreesOfFreedom) {
  for (const double dof : {0.5, 7.0, 1e3, 3e5}) {
    for (const double probability : {1e-6, 0.025, 0.5, 0.975}) {
      EXPECT_NEAR(chi_square_cdf(chi_square_quantile(probability, dof), dof), probability, 1e-9);
    }
  }
}

TEST(ChiSquare, RefusesWhatHasNoMeaning) {
  EXPECT_EQ(chi_square_cdf(-1.0, 3), 0.0);
  EXPECT_THROW(chi_square_cdf(1.0, 0), std::invalid_argument);
  EXPECT_THROW(chi_square_cdf(std::nan(""), 3), std::invalid_argument);
  EXPECT_THROW(chi_square_quantile(0.0, 3), std::invalid_argument);
  EXPECT_THROW(chi_square_quantile(1.0, 3), std::invalid_argument);
  EXPECT_THROW(chi_square_quantile(0.5, -1), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::evaluation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/normal_samples.hpp"

#include "topoloc/evaluation/median.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

TEST(NormalSamples, HaveTheMomentsOfTheStandardNormalDistribution) {
  constexpr int kCount = 100'000;
  NormalSamples normal(5);
  double sum = 0.0;
  double square = 0.0;
  double neighbours = 0.0;
  double last = 0.0;
  std::vector<double> sizes;
  for (int i = 0; i < kCount; ++i) {
    const double x = normal();
    sum += x;
    square += x * x;
    neighbours += x * last;
    last = x;
    sizes.push_back(std::abs(x));
  }
  EXPECT_NEAR(sum / kCount, 0.0, 0.01);
  EXPECT_NEAR(square / kCount, 1.0, 0.02);
  EXPECT_NEAR(neighbours / kCount, 0.0, 0.01);
  EXPECT_NEAR(evaluation::median(sizes), 0.6745, 0.01);
}

TEST(NormalSamples, AreTheSameEverywhere) {
  NormalSamples normal(42);
  for (const double expected : {0.70498826642085988, 1.2938204232729367, -0.5740948067202617}) {
    EXPECT_DOUBLE_EQ(normal(), expected);
  }
}

}  // namespace
}  // namespace topoloc::refinement

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/rotation_ransac.hpp"

#include "topoloc/geometry/so3.hpp"

#include "support/random_states.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace topoloc::refinement {
namespace {

constexpr double kThreshold_rad = 0.01;
const Eigen::Matrix3d kTrue = so3::exp({0.02, -0.05, 0.03});

Eigen::Vector3d bearing(test::Random& random) {
  return Eigen::Vector3d(random.uniform(-0.7, 0.7), random.uniform(-0.4, 0.4), 1.0).normalized();
}

/// Pairs of which the first share is true up to noise, the rest is anywhere.
std::vector<BearingPair> pairs(std::size_t count, std::size_t true_ones, std::uint64_t seed) {
  constexpr double kNoise_rad = 0.002;
  test::Random random(seed);
  std::vector<BearingPair> result;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d from = bearing(random);
    const Eigen::Matrix3d noise = so3::exp(kNoise_rad * random.normal_vector<3>());
    const Eigen::Vector3d anywhere = bearing(random);
    result.push_back({from, i < true_ones ? noise * kTrue * from : anywhere, kThreshold_rad});
  }
  return result;
}

TEST(RotationRansac, FindsTheRotationThoughMostPairsAreWrong) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const auto found = rotation_ransac(pairs(100, 40, seed));
    ASSERT_TRUE(found.has_value());
    EXPECT_LT(so3::log(found->R_to_from.transpose() * kTrue).norm(), kThreshold_rad);
    std::size_t true_ones = 0;
    for (const std::size_t i : found->inliers) {
      true_ones += i < 40 ? 1 : 0;
    }
    EXPECT_GE(true_ones, 36U);
    EXPECT_LE(found->inliers.size() - true_ones, 2U);
  }
}

TEST(RotationRansac, GivesARotationMatrix) {
  const Eigen::Matrix3d R = rotation_ransac(pairs(30, 30, 4))->R_to_from;
  EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_NEAR(R.determinant(), 1.0, 1e-12);
}

TEST(RotationRansac, GivesTheSameBitsTwice) {
  const auto input = pairs(100, 40, 5);
  const auto first = rotation_ransac(input);
  const auto second = rotation_ransac(input);
  EXPECT_EQ(first->R_to_from, second->R_to_from);
  EXPECT_EQ(first->inliers, second->inliers);
}

TEST(RotationRansac, FindsNothingInTooLittle) {
  EXPECT_FALSE(rotation_ransac({}).has_value());
  const auto one = pairs(1, 1, 6);
  EXPECT_FALSE(rotation_ransac(one).has_value());
  // The same bearing twice leaves the turn about it open.
  const std::vector<BearingPair> twice{one[0], one[0]};
  EXPECT_FALSE(rotation_ransac(twice).has_value());
}

TEST(RotationRansac, CountsNearPairsWithTheirOwnThreshold) {
  std::vector<BearingPair> input = pairs(20, 20, 7);
  test::Random random(8);
  const Eigen::Vector3d from = bearing(random);
  const Eigen::Vector3d aside = so3::exp({0.0, 0.03, 0.0}) * (kTrue * from);
  input.push_back({from, aside, kThreshold_rad});
  input.push_back({from, aside, 0.05});
  const auto inliers = rotation_ransac(input)->inliers;
  EXPECT_EQ(inliers.back(), 21U);
  EXPECT_NE(*(inliers.end() - 2), 20U);
}

}  // namespace
}  // namespace topoloc::refinement

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/ratio_matcher.hpp"

#include "support/matching_scene.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace topoloc::matching {
namespace {

using testing::Random;

/// Unit vector in the plane of the first two axes.
Eigen::VectorXf at_angle(double rad) {
  Eigen::VectorXf d = Eigen::VectorXf::Zero(64);
  d[0] = static_cast<float>(std::cos(rad));
  d[1] = static_cast<float>(std::sin(rad));
  return d;
}

double chord(double rad) { return 2.0 * std::sin(0.5 * rad); }

TEST(RatioMatcher, ComparesTheDistanceOfTheNearestWithThatOfTheSecond) {
  FeatureSet node(2, 64);
  testing::append(node, {0, 0}, at_angle(0.2));
  testing::append(node, {0, 0}, at_angle(-0.4));
  FeatureSet query(1, 64);
  testing::append(query, {0, 0}, at_angle(0.0));
  const double ratio = chord(0.2) / chord(0.4);
  std::vector<FeatureMatch> matches;
  RatioMatcher(ratio + 0.01).match(query, node, matches);
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].node, 0);
  EXPECT_NEAR(matches[0].score, std::cos(0.2), 1e-6);
  RatioMatcher(ratio - 0.01).match(query, node, matches);
  EXPECT_TRUE(matches.empty());
}

TEST(RatioMatcher, TwoThatLookTheSameMatchNothing) {
  FeatureSet node(2, 64);
  testing::append(node, {0, 0}, at_angle(0.0));
  testing::append(node, {9, 9}, at_angle(0.0));
  std::vector<FeatureMatch> matches;
  RatioMatcher(1.0).match(node, node, matches);
  EXPECT_TRUE(matches.empty());
}

TEST(RatioMatcher, OfSeveralQueriesForOneNodeFeatureTheNearestStays) {
  FeatureSet node(2, 64);
  testing::append(node, {0, 0}, at_angle(0.0));
  testing::append(node, {0, 0}, at_angle(2.0));
  FeatureSet query(3, 64);
  for (const double angle : {0.1, 0.05, -0.2}) {
    testing::append(query, {0, 0}, at_angle(angle));
  }
  std::vector<FeatureMatch> matches;
  RatioMatcher(0.8).match(query, node, matches);
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].query, 1);
}

TEST(RatioMatcher, SetsWithoutASecondBestGiveNoMatchesAndOtherLengthsAnError) {
  Random random(3);
  FeatureSet one(1, 64);
  testing::append(one, {0, 0}, random.descriptor(64));
  FeatureSet others(2, 128);
  testing::append(others, {0, 0}, random.descriptor(128));
  testing::append(others, {0, 0}, random.descriptor(128));
  RatioMatcher matcher(0.8);
  std::vector<FeatureMatch> matches{{1, 1, 1.0F}};
  matcher.match(one, one, matches);
  EXPECT_TRUE(matches.empty());
  EXPECT_THROW(matcher.match(one, others, matches), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::matching

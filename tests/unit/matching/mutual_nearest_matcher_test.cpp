// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/mutual_nearest_matcher.hpp"

#include "support/matching_scene.hpp"

#include <gtest/gtest.h>

namespace topoloc::matching {
namespace {

using testing::Random;

TEST(MutualNearestMatcher, RecoversAPermutationOfNoisyDescriptors) {
  Random random(1);
  constexpr int kCount = 200;
  FeatureSet node(kCount, 64);
  FeatureSet query(kCount + 50, 64);
  std::vector<Eigen::VectorXf> descriptors;
  for (int i = 0; i < kCount; ++i) {
    descriptors.push_back(random.descriptor(64));
    testing::append(node, {0, 0}, descriptors.back());
  }
  for (int i = 0; i < kCount; ++i) {  // 7 is prime to 200: a permutation
    testing::append(query, {0, 0},
                    random.seen_again(descriptors[static_cast<std::size_t>(7 * i % kCount)], 0.5));
  }
  for (int i = 0; i < 50; ++i) {
    testing::append(query, {0, 0}, random.descriptor(64));
  }
  std::vector<FeatureMatch> matches;
  MutualNearestMatcher(0.7).match(query, node, matches);
  EXPECT_GE(matches.size(), 198U);
  for (const FeatureMatch& m : matches) {
    EXPECT_EQ(m.node, 7 * m.query % kCount);
    EXPECT_GE(m.score, 0.7F);
  }
  MutualNearestMatcher(0.999).match(query, node, matches);
  EXPECT_TRUE(matches.empty());
}

TEST(MutualNearestMatcher, IsMutual) {
  Random random(2);
  const Eigen::VectorXf d = random.descriptor(64);
  FeatureSet node(1, 64);
  FeatureSet query(2, 64);
  testing::append(node, {0, 0}, d);
  testing::append(query, {0, 0}, random.seen_again(d, 0.3));
  testing::append(query, {0, 0}, d);
  std::vector<FeatureMatch> matches;
  MutualNearestMatcher(0.5).match(query, node, matches);
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].query, 1);
}

TEST(MutualNearestMatcher, EmptySetsGiveNoMatchesAndOtherLengthsAnError) {
  Random random(3);
  FeatureSet one(1, 64);
  testing::append(one, {0, 0}, random.descriptor(64));
  FeatureSet other(1, 128);
  testing::append(other, {0, 0}, random.descriptor(128));
  MutualNearestMatcher matcher(0.5);
  std::vector<FeatureMatch> matches{{1, 1, 1.0F}};
  matcher.match(FeatureSet(5, 64), one, matches);
  EXPECT_TRUE(matches.empty());
  matcher.match(one, FeatureSet(5, 64), matches);
  EXPECT_TRUE(matches.empty());
  EXPECT_THROW(matcher.match(one, other, matches), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::matching

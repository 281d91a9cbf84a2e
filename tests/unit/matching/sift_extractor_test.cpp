// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/features.hpp"

#include <algorithm>
#include <memory>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace topoloc::matching {
namespace {

constexpr int kWidth_px = 320;
constexpr int kHeight_px = 192;

/// Discs of all greys and sizes anywhere.
cv::Mat discs(std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat image(kHeight_px, kWidth_px, CV_8UC1, cv::Scalar(128));
  for (int i = 0; i < 150; ++i) {
    cv::circle(image, {random.uniform(0, kWidth_px), random.uniform(0, kHeight_px)},
               random.uniform(2, 9), cv::Scalar(random.uniform(0, 256)), cv::FILLED, cv::LINE_AA);
  }
  return image;
}

std::unique_ptr<FeatureExtractor> sift(int max_features = 256) {
  MatchingConfig config;
  config.extractor = "sift";
  config.matcher = "ratio";
  config.width_px = kWidth_px;
  config.height_px = kHeight_px;
  config.max_features = max_features;
  config.model_dir = "/nonexistent";  // it needs no file
  return make_extractor(config);
}

TEST(SiftExtractor, FindsTheSamePointsInAShiftedImage) {
  const cv::Mat image = discs(1);
  const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, 7, 0, 1, -4);
  cv::Mat moved;
  cv::warpAffine(image, moved, shift, image.size(), cv::INTER_NEAREST, cv::BORDER_REFLECT);
  FeatureSet node;
  FeatureSet query;
  const auto extractor = sift();
  EXPECT_EQ(extractor->identity().name, "sift");
  EXPECT_EQ(extractor->identity().descriptor_dim, 128);
  extractor->extract(image, node);
  extractor->extract(moved, query);
  MatchingConfig config;
  config.extractor = "sift";
  config.matcher = "ratio";
  std::vector<FeatureMatch> matches;
  make_matcher(config)->match(query, node, matches);
  ASSERT_GE(matches.size(), 50U);
  const auto right = std::count_if(matches.begin(), matches.end(), [&](const FeatureMatch& m) {
    const Eigen::Vector2f way = query.pixels_px[static_cast<std::size_t>(m.query)] -
                                node.pixels_px[static_cast<std::size_t>(m.node)];
    return (way - Eigen::Vector2f(7, -4)).norm() < 0.5F;
  });
  EXPECT_GE(static_cast<double>(right), 0.95 * static_cast<double>(matches.size()));
}

TEST(SiftExtractor, GivesTheStrongestFirstAndUnitDescriptorsNoMoreThanAskedFor) {
  FeatureSet set;
  sift(60)->extract(discs(2), set);
  EXPECT_EQ(set.count, 60);
  EXPECT_EQ(set.width_px, kWidth_px);
  for (int i = 0; i < set.count; ++i) {
    const auto slot = static_cast<std::size_t>(i);
    EXPECT_GT(set.scores[slot], 0.0F);
    EXPECT_LE(set.scores[slot], i == 0 ? 1.0F : set.scores[slot - 1]);
    EXPECT_NEAR(set.descriptor_matrix().row(i).norm(), 1.0F, 1e-5F);
  }
}

TEST(SiftExtractor, FindsNothingWhereTheMaskIsZeroOrTheImageFlat) {
  const auto extractor = sift();
  FeatureSet set;
  extractor->extract(cv::Mat(kHeight_px, kWidth_px, CV_8UC1, cv::Scalar(90)), set);
  EXPECT_EQ(set.count, 0);
  cv::Mat mask(kHeight_px, kWidth_px, CV_8UC1, cv::Scalar(255));
  mask.colRange(0, kWidth_px / 2).setTo(0);
  extractor->set_mask(mask);
  extractor->extract(discs(3), set);
  ASSERT_GT(set.count, 10);
  for (int i = 0; i < set.count; ++i) {
    EXPECT_GE(set.pixels_px[static_cast<std::size_t>(i)].x(), kWidth_px / 2 - 1);
  }
}

TEST(SiftExtractor, RefusesImagesAndMasksOfAnotherSizeOrType) {
  const auto extractor = sift();
  FeatureSet set;
  EXPECT_THROW(extractor->extract(cv::Mat(10, 10, CV_8UC1), set), std::invalid_argument);
  EXPECT_THROW(extractor->extract(cv::Mat(kHeight_px, kWidth_px, CV_8UC3), set),
               std::invalid_argument);
  EXPECT_THROW(extractor->set_mask(cv::Mat(10, 10, CV_8UC1)), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::matching

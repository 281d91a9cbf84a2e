// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "matching/feature_pair_matcher.hpp"

#include "topoloc/matching/mutual_nearest_matcher.hpp"

#include <filesystem>
#include <memory>

#include <gtest/gtest.h>

namespace topoloc::matching {
namespace {

/// Every pixel that is neither black nor masked is a feature, described by its grey value, up to
/// half a pixel beside it as sub-pixel refinement may put it.
class BrightPixels final : public FeatureExtractor {
 public:
  [[nodiscard]] const map::ModelIdentity& identity() const override { return identity_; }
  [[nodiscard]] int max_features() const override { return size_.area(); }
  [[nodiscard]] cv::Size input_size() const override { return size_; }
  void set_mask(const cv::Mat& mask) override { mask_ = mask.clone(); }
  void extract(const cv::Mat& grey, FeatureSet& out) override {
    out = FeatureSet(max_features(), 2);
    for (int y = 0; y < grey.rows; ++y) {
      for (int x = 0; x < grey.cols; ++x) {
        const auto value = grey.at<std::uint8_t>(y, x);
        if (value == 0 || mask_.at<std::uint8_t>(y, x) == 0) {
          continue;
        }
        const auto at = static_cast<std::size_t>(out.count++);
        const float angle = static_cast<float>(value) / 100.0F;
        out.pixels_px[at] = {static_cast<float>(x) + refinement_px, static_cast<float>(y)};
        out.descriptors[2 * at] = std::cos(angle);
        out.descriptors[2 * at + 1] = std::sin(angle);
      }
    }
  }

  float refinement_px = 0.0F;

 private:
  map::ModelIdentity identity_{.name = "bright", .fingerprint = 1, .descriptor_dim = 2};
  cv::Size size_{8, 4};
  cv::Mat mask_;
};

class FeaturePairs : public ::testing::Test {
 protected:
  [[nodiscard]] std::vector<PixelMatch> match(const cv::Mat& mask0, const cv::Mat& mask1) {
    auto extractor = std::make_unique<BrightPixels>();
    extractor->refinement_px = refinement_px_;
    FeaturePairMatcher matcher(std::move(extractor), std::make_unique<MutualNearestMatcher>(0.99));
    std::vector<PixelMatch> out = {{{1.0F, 2.0F}, {3.0F, 4.0F}, 5.0F}};  // to be replaced
    matcher.match({image0_, mask0}, {image1_, mask1}, out);
    return out;
  }
  void SetUp() override {
    image0_.at<std::uint8_t>(1, 2) = 40;
    image0_.at<std::uint8_t>(3, 7) = 90;
    image1_.at<std::uint8_t>(2, 4) = 40;
    image1_.at<std::uint8_t>(0, 1) = 91;  // a little less alike
  }

  cv::Mat image0_ = cv::Mat::zeros(4, 8, CV_8UC1);
  cv::Mat image1_ = cv::Mat::zeros(4, 8, CV_8UC1);
  float refinement_px_ = 0.0F;
};

TEST_F(FeaturePairs, SayWhereTheFeaturesThatMatchAreSurestFirst) {
  const auto matches = match({}, {});
  ASSERT_EQ(matches.size(), 2U);
  EXPECT_EQ(matches[0].pixel0_px, Eigen::Vector2f(2.0F, 1.0F));
  EXPECT_EQ(matches[0].pixel1_px, Eigen::Vector2f(4.0F, 2.0F));
  EXPECT_EQ(matches[1].pixel0_px, Eigen::Vector2f(7.0F, 3.0F));
  EXPECT_EQ(matches[1].pixel1_px, Eigen::Vector2f(1.0F, 0.0F));
  EXPECT_GT(matches[0].confidence, matches[1].confidence);
}

TEST_F(FeaturePairs, EachImageHasItsOwnMask) {
  cv::Mat mask(image0_.size(), CV_8UC1, cv::Scalar(255));
  mask.at<std::uint8_t>(1, 2) = 0;
  EXPECT_EQ(match(mask, {}).size(), 1U);
  EXPECT_EQ(match({}, mask).size(), 2U);
}

TEST_F(FeaturePairs, NeverLieOnAMaskedNeighbourOrOutside) {
  cv::Mat mask(image0_.size(), CV_8UC1, cv::Scalar(255));
  mask.at<std::uint8_t>(1, 3) = 0;
  refinement_px_ = 0.6F;  // onto (3, 1); (7, 3) leaves the image
  EXPECT_TRUE(match(mask, {}).empty());
  EXPECT_EQ(match({}, {}).size(), 1U);
}

TEST(MakePairMatcher, RefusesAMatcherThatNeedsAPrediction) {
  MatchingConfig config;
  if (!std::filesystem::exists(default_model_dir() / "xfeat_640x384_n512.onnx")) {
    GTEST_SKIP() << "no models in " << default_model_dir();
  }
  config.matcher = "guided";
  EXPECT_THROW(make_pair_matcher(config), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::matching

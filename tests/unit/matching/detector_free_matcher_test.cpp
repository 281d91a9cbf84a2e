// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/image_pair_matcher.hpp"

#include "support/matching_scene.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace topoloc::matching {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// Of the networks that tests/python/pair_models.py makes.
constexpr int kWidth_px = 96;
constexpr int kHeight_px = 64;

cv::Mat noise(std::uint32_t seed, cv::Size size = {kWidth_px, kHeight_px}) {
  testing::Random random(seed);
  cv::Mat image(size, CV_8UC1);
  std::generate(image.begin<std::uint8_t>(), image.end<std::uint8_t>(),
                [&] { return static_cast<std::uint8_t>(random.index(256)); });
  return image;
}

/// What is at p in `image` is at p + shift in the result; noise comes in from outside.
cv::Mat shifted(const cv::Mat& image, cv::Point shift) {
  cv::Mat out = noise(99, image.size());
  const cv::Rect all({0, 0}, image.size());
  image((all - shift) & all).copyTo(out((all + shift) & all));
  return out;
}

class DetectorFree : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(model("block"))) {
      GTEST_SKIP() << "no " << model("block") << ": `ctest -R make_pair_models` makes it";
    }
    config_.min_match_score = 0.9;
    config_.width_px = kWidth_px;
    config_.height_px = kHeight_px;
  }
  static std::filesystem::path model(const std::string& name) {
    return std::filesystem::path(TOPOLOC_BIN_DIR).parent_path() / "pair-models" / (name + ".onnx");
  }
  [[nodiscard]] std::vector<PixelMatch> match(const std::string& name, const MaskedImage& image0,
                                              const MaskedImage& image1) const {
    std::vector<PixelMatch> out = {{{1.0F, 2.0F}, {3.0F, 4.0F}, 5.0F}};  // to be replaced
    make_pair_matcher(config_, model(name))->match(image0, image1, out);
    return out;
  }
  void expect_refused(const std::filesystem::path& file, const char* because) const {
    EXPECT_THAT([&] { make_pair_matcher(config_, file); },
                ThrowsMessage<std::runtime_error>(
                    ::testing::AllOf(HasSubstr(file.string()), HasSubstr(because))));
  }

  MatchingConfig config_;
  cv::Mat image_ = noise(1);
};

TEST_F(DetectorFree, FindsTheShiftBetweenTwoImages) {
  // A fixed number of slots; a number that depends on the images, whose size the file leaves open.
  for (const char* name : {"block", "block_open"}) {
    const auto matches = match(name, {image_, {}}, {shifted(image_, {7, -5}), {}});
    EXPECT_GT(matches.size(), 60U) << name;
    for (const PixelMatch& match : matches) {
      EXPECT_EQ((match.pixel1_px - match.pixel0_px), Eigen::Vector2f(7.0F, -5.0F));
      EXPECT_GT(match.confidence, 0.9F);
    }
    EXPECT_TRUE(std::is_sorted(matches.begin(), matches.end(), [](const auto& a, const auto& b) {
      return a.confidence > b.confidence;
    }));
  }
}

TEST_F(DetectorFree, FindsNothingInImagesThatHaveNothingInCommon) {
  EXPECT_TRUE(match("block", {image_, {}}, {noise(2), {}}).empty());
  const cv::Mat flat(image_.size(), CV_8UC1, cv::Scalar(128));
  EXPECT_TRUE(match("block", {flat, {}}, {flat, {}}).empty());
  EXPECT_TRUE(match("block_open", {image_, {}}, {noise(2), {}}).empty());
}

TEST_F(DetectorFree, MinMatchScoreDecidesWhatIsAMatch) {
  config_.min_match_score = 0.0;
  EXPECT_EQ(match("block", {image_, {}}, {noise(2), {}}).size(), 11U * 7U);
}

TEST_F(DetectorFree, GivesNoMatchOnAMaskedPixelOfEitherImage) {
  cv::Mat mask0(image_.size(), CV_8UC1, cv::Scalar(1));
  mask0.colRange(0, 40) = 0;
  cv::Mat mask1(image_.size(), CV_8UC1, cv::Scalar(255));
  mask1.rowRange(30, kHeight_px) = 0;
  const auto matches = match("block", {image_, mask0}, {shifted(image_, {7, -5}), mask1});
  EXPECT_GT(matches.size(), 10U);
  for (const PixelMatch& match : matches) {
    EXPECT_GE(match.pixel0_px.x(), 40.0F);
    EXPECT_LT(match.pixel1_px.y(), 30.0F);
  }
}

TEST_F(DetectorFree, HandsTheMaskToANetworkThatTakesOne) {
  config_.min_match_score = 0.0;
  cv::Mat mask(image_.size(), CV_8UC1, cv::Scalar(1));  // anything but 0 keeps
  mask.colRange(kWidth_px / 4, kWidth_px / 2) = 0;
  const auto matcher = make_pair_matcher(config_, model("masked_mean"));
  std::vector<PixelMatch> out;
  matcher->match({image_, mask}, {image_, {}}, out);
  ASSERT_EQ(out.size(), 1U);
  EXPECT_NEAR(out[0].confidence, 0.75F, 1e-6F);
  matcher->match({image_, {}}, {image_, {}}, out);  // not the mask of before
  ASSERT_EQ(out.size(), 1U);
  EXPECT_NEAR(out[0].confidence, 1.0F, 1e-6F);
}

TEST_F(DetectorFree, TakesTheSizeOfTheFileOrTheConfiguredOne) {
  config_.width_px = 2 * kWidth_px;
  EXPECT_EQ(make_pair_matcher(config_, model("block"))->input_size(),
            cv::Size(kWidth_px, kHeight_px));
  EXPECT_EQ(make_pair_matcher(config_, model("block_open"))->input_size(),
            cv::Size(2 * kWidth_px, kHeight_px));
}

TEST_F(DetectorFree, RefusesImagesAndMasksOfAnotherSizeOrType) {
  const cv::Mat small = noise(1, {kWidth_px - 1, kHeight_px});
  cv::Mat colour;
  cv::cvtColor(image_, colour, cv::COLOR_GRAY2BGR);
  for (const cv::Mat& wrong : {small, colour, cv::Mat()}) {
    EXPECT_THROW(match("block", {wrong, {}}, {image_, {}}), std::invalid_argument);
    EXPECT_THROW(match("block", {image_, {}}, {wrong, {}}), std::invalid_argument);
  }
  EXPECT_THROW(match("block", {image_, small}, {image_, {}}), std::invalid_argument);
}

TEST_F(DetectorFree, RefusesAModelThatIsNotOneSayingWhy) {
  expect_refused("/nonexistent/loftr.onnx", "cannot read");
  expect_refused(model("wrong_names"), "no output 'keypoints0', it has: mkpts0_f, mkpts1_f, mconf");
  expect_refused(model("colour"),
                 "input 'image0' is float32 1x3x64x96, expected float32 1x1x64x96");
  expect_refused(model("extra_input"), "an input 'scale'");
}

TEST_F(DetectorFree, RefusesOutputsThatDisagree) {
  EXPECT_THAT(
      [&] {
        static_cast<void>(match("disagreeing", {image_, {}}, {image_, {}}));
      },
      ThrowsMessage<std::runtime_error>(HasSubstr("1 keypoints0, 2 keypoints1, 1 confidence")));
}

}  // namespace
}  // namespace topoloc::matching

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/features.hpp"
#include "topoloc/matching/image_pair_matcher.hpp"
#include "topoloc/matching/undistorter.hpp"

#include "support/data_dir.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>

namespace topoloc::matching {
namespace {

/// Left grey camera of 2011_09_26, raw: K_00, D_00 of calib_cam_to_cam.txt.
CameraCalibration kitti_raw_camera() {
  return {.pinhole = {.width_px = 1392,
                      .height_px = 512,
                      .fx_px = 984.2439,
                      .fy_px = 980.8141,
                      .cx_px = 690.0,
                      .cy_px = 233.1966},
          .distortion = Distortion::kRadTan,
          .coefficients = {-0.3728755, 0.2037299, 2.219027e-3, 1.383707e-3, -0.07233722}};
}

/// Two frames 0.3 s (2 to 3 m) apart, undistorted, and the real networks.
class KittiImages : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto folder = testing::data_dir() / "kitti_0039" / "image_00";
    const cv::Mat raw0 = cv::imread((folder / "000100.jpg").string(), cv::IMREAD_GRAYSCALE);
    const cv::Mat raw1 = cv::imread((folder / "000103.jpg").string(), cv::IMREAD_GRAYSCALE);
    if (raw0.empty() || raw1.empty()) {
      GTEST_SKIP() << "no drive kitti_0039 in " << testing::data_dir();
    }
    if (!std::filesystem::exists(default_model_dir() / "xfeat_640x384_n512.onnx")) {
      GTEST_SKIP() << "no models in " << default_model_dir();
    }
    const Undistorter undistorter(kitti_raw_camera(), matching_camera(config_));
    undistorter.undistort(raw0, image0_);
    undistorter.undistort(raw1, image1_);
    mask_ = undistorter.mask({}, config_.mask_erosion_px);
  }

  [[nodiscard]] FeatureSet extract(const cv::Mat& image, int threads = 2) const {
    MatchingConfig config = config_;
    config.threads = threads;
    const auto extractor = make_extractor(config);
    extractor->set_mask(mask_);
    FeatureSet out;
    extractor->extract(image, out);
    return out;
  }

  [[nodiscard]] std::vector<FeatureMatch> match(const std::string& matcher, int threads = 2) const {
    MatchingConfig config = config_;
    config.matcher = matcher;
    config.threads = threads;
    std::vector<FeatureMatch> out;
    make_matcher(config)->match(extract(image1_), extract(image0_), out);
    return out;
  }

  /// Share of matches within 2 px of an epipolar geometry common to most of them.
  [[nodiscard]] double epipolar_share(const std::vector<FeatureMatch>& matches) const {
    const FeatureSet query = extract(image1_);
    const FeatureSet node = extract(image0_);
    std::vector<cv::Point2f> a;
    std::vector<cv::Point2f> b;
    for (const FeatureMatch& m : matches) {
      const auto& p = query.pixels_px[static_cast<std::size_t>(m.query)];
      const auto& q = node.pixels_px[static_cast<std::size_t>(m.node)];
      a.emplace_back(p.x(), p.y());
      b.emplace_back(q.x(), q.y());
    }
    const PinholeCamera camera = matching_camera(config_);
    std::vector<std::uint8_t> inliers;
    cv::findEssentialMat(a, b, camera.fx_px, {camera.cx_px, camera.cy_px}, cv::RANSAC, 0.999, 2.0,
                         inliers);
    return static_cast<double>(std::count(inliers.begin(), inliers.end(), 1)) /
           static_cast<double>(matches.size());
  }

  MatchingConfig config_;
  cv::Mat image0_;
  cv::Mat image1_;
  cv::Mat mask_;
};

TEST_F(KittiImages, ExtractionIsBitIdenticalRunToRunAndWithAnyNumberOfThreads) {
  const FeatureSet first = extract(image0_, 2);
  for (const int threads : {2, 1}) {
    const FeatureSet again = extract(image0_, threads);
    EXPECT_EQ(first.count, again.count);
    EXPECT_EQ(first.pixels_px, again.pixels_px);
    EXPECT_EQ(first.scores, again.scores);
    EXPECT_EQ(first.descriptors, again.descriptors);
  }
}

TEST_F(KittiImages, FeaturesAreValidAndRespectTheMask) {
  cv::Mat left_half = mask_.clone();
  left_half.colRange(left_half.cols / 2, left_half.cols) = 0;
  mask_ = left_half;
  const FeatureSet set = extract(image0_);
  EXPECT_GE(set.count, 200);
  for (int i = 0; i < set.count; ++i) {
    const auto slot = static_cast<std::size_t>(i);
    // Sub-pixel refinement may step over the mask's edge by less than a pixel.
    EXPECT_LT(set.pixels_px[slot].x(), static_cast<float>(left_half.cols) / 2.0F + 1.0F);
    EXPECT_NEAR(set.descriptor_matrix().row(i).norm(), 1.0F, 1e-4F);
    EXPECT_TRUE(i == 0 || set.scores[slot] <= set.scores[slot - 1]);
  }
}

TEST_F(KittiImages, NeighbouringFramesMatchConsistentlyByNearestNeighbour) {
  const auto matches = match("mutual");
  EXPECT_GT(matches.size(), 150U);
  EXPECT_GT(epipolar_share(matches), 0.8);
}

TEST_F(KittiImages, NeighbouringFramesMatchConsistentlyByLighterGlue) {
  const auto matches = match("lighterglue");
  EXPECT_GT(matches.size(), 200U);
  EXPECT_GT(epipolar_share(matches), 0.8);
}

TEST_F(KittiImages, APairMatcherFindsWhatItsFeatureMatcherFinds) {
  std::vector<PixelMatch> pairs;
  make_pair_matcher(config_)->match({image1_, mask_}, {image0_, mask_}, pairs);
  const FeatureSet query = extract(image1_);
  const FeatureSet node = extract(image0_);
  const std::vector<FeatureMatch> matches = match("lighterglue");
  // Less a few at the mask's edge, which the pair matcher keeps to by the pixel.
  EXPECT_LE(pairs.size(), matches.size());
  EXPECT_GT(static_cast<double>(pairs.size()), 0.97 * static_cast<double>(matches.size()));
  for (const PixelMatch& pair : pairs) {
    EXPECT_TRUE(std::any_of(matches.begin(), matches.end(), [&](const FeatureMatch& m) {
      return query.pixels_px[static_cast<std::size_t>(m.query)] == pair.pixel0_px &&
             node.pixels_px[static_cast<std::size_t>(m.node)] == pair.pixel1_px &&
             m.score == pair.confidence;
    }));
  }
}

TEST_F(KittiImages, LighterGlueIsBitIdenticalWithAnyNumberOfThreads) {
  const auto two = match("lighterglue", 2);
  const auto one = match("lighterglue", 1);
  ASSERT_EQ(two.size(), one.size());
  for (std::size_t i = 0; i < two.size(); ++i) {
    EXPECT_EQ(two[i].query, one[i].query);
    EXPECT_EQ(two[i].node, one[i].node);
    EXPECT_EQ(two[i].score, one[i].score);
  }
}

TEST_F(KittiImages, AnEmptyOrFlatImageGivesFewFeaturesAndNoNonsense) {
  const FeatureSet flat = extract(cv::Mat(image0_.size(), CV_8UC1, cv::Scalar(128)));
  for (int i = 0; i < flat.count; ++i) {
    EXPECT_TRUE(flat.pixels_px[static_cast<std::size_t>(i)].allFinite());
    EXPECT_TRUE(flat.descriptor_matrix().row(i).allFinite());
  }
  EXPECT_LT(flat.count, 50);
  std::vector<FeatureMatch> out;
  make_matcher(config_)->match(FeatureSet(512, 64), extract(image0_), out);
  EXPECT_TRUE(out.empty());
}

}  // namespace
}  // namespace topoloc::matching

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/map_matcher.hpp"

#include "topoloc/map/map_file.hpp"
#include "topoloc/map/map_writer.hpp"

#include "support/matching_scene.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace topoloc::matching {
namespace {

using testing::Random;
using testing::test_camera;
using testing::test_T_imu_cam;

/// Rectangles of all sizes and greys: corners everywhere.
cv::Mat patchwork(std::uint32_t seed) {
  Random random(seed);
  cv::Mat image(test_camera().height_px, test_camera().width_px, CV_8UC1, cv::Scalar(110));
  for (int i = 0; i < 400; ++i) {
    const cv::Rect box(random.index(image.cols), random.index(image.rows), 8 + random.index(50),
                       8 + random.index(50));
    cv::rectangle(image, box, cv::Scalar(random.index(256)), cv::FILLED);
  }
  cv::GaussianBlur(image, image, {3, 3}, 0.8);
  return image;
}

/// A map of three nodes at one place: nodes 0 and 2 saw `image`, node 1 looks the other way.
class MapMatcherTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(default_model_dir() / "xfeat_640x384_n512.onnx")) {
      GTEST_SKIP() << "no models in " << default_model_dir();
    }
    config_.matcher = "mutual";
    T_world_imu_ = {so3::exp({0.02, -0.03, 0.7}), {350.0, -120.0, 4.0}};
    path_ =
        std::filesystem::temp_directory_path() /
        ("map_matcher_" +
         std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + ".tmap");
    write_map();
  }
  void TearDown() override { std::filesystem::remove(path_); }

  void write_map() {
    const auto extractor = make_extractor(config_);
    FeatureSet features;
    extractor->extract(image_, features);
    map::MapWriter writer(path_, {.camera = test_camera(),
                                  .T_imu_cam = test_T_imu_cam(),
                                  .model = extractor->identity(),
                                  .origin_m = Eigen::Vector3d::Zero(),
                                  .crs = "",
                                  .creator = "test"});
    Random random(1);
    std::int64_t time_ns = 0;
    for (const double turn_rad : {0.0, std::numbers::pi, 0.0}) {
      map::NodeDraft draft;
      draft.time_ns = ++time_ns;
      draft.T_world_cam = T_world_imu_ * test_T_imu_cam();
      draft.T_world_cam.R *= so3::exp({0.0, turn_rad, 0.0});
      draft.covariance = 1e-4 * Eigen::Matrix<double, 6, 6>::Identity();
      for (int i = 0; i < features.count; ++i) {
        const auto slot = static_cast<std::size_t>(i);
        // Seen from the node's own pose, any depth reprojects onto the pixel. One in four: none.
        const bool lifted = i % 4 != 0;
        draft.features.push_back(
            {.pixel_px = features.pixels_px[slot],
             .depth_m = lifted ? static_cast<float>(random.uniform(4.0, 40.0)) : 0.0F,
             .depth_std_m = lifted ? 0.05F : 0.0F,
             .score = features.scores[slot]});
      }
      const std::size_t values = static_cast<std::size_t>(features.count) * 64;
      draft.descriptors.resize(values);
      map::encode_descriptors(std::span(features.descriptors).first(values), draft.descriptors);
      writer.add(draft);
    }
    writer.finish();
  }

  /// Flips a bit in the first feature block.
  void damage_node_0() const {
    const std::vector<map::SectionInfo> sections = map::MapFile(path_).sections();
    const auto features =
        std::find_if(sections.begin(), sections.end(),
                     [](const map::SectionInfo& section) { return section.name == "FEAT"; });
    ASSERT_NE(features, sections.end());
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    const auto at = static_cast<std::streamoff>(features->offset) + 40;
    file.seekg(at);
    const int byte = file.get();
    file.seekp(at);
    file.put(static_cast<char>(byte ^ 1));
  }

  [[nodiscard]] MapMatcher matcher(const map::MapFile& map) const {
    return {config_, map, {.pinhole = test_camera()}, test_T_imu_cam(), cv::Mat()};
  }
  /// The true pose moved by 0.3 m and turned by 1 degree.
  [[nodiscard]] PosePrediction prediction() const {
    return {{T_world_imu_.R * so3::exp({0.006, -0.012, 0.011}),
             T_world_imu_.p + Eigen::Vector3d(0.2, -0.2, 0.1)},
            testing::pose_covariance(0.01, 0.18)};
  }
  void expect_true_matches(const estimation::MapMatchSet& set) const {
    const RigidTransform T_cam_world = (T_world_imu_ * test_T_imu_cam()).inverse();
    for (int i = 0; i < set.match_count; ++i) {
      const auto& match = set.matches[static_cast<std::size_t>(i)];
      const Eigen::Vector2d seen = test_camera().project(T_cam_world * match.p_world_m);
      EXPECT_LT((seen - match.pixel_px).norm(), 4.0);
      EXPECT_GE(match.pixel_std_px, config_.pixel_std_px);
      EXPECT_EQ(match.node_slot, 0);
    }
  }

  MatchingConfig config_;
  cv::Mat image_ = patchwork(1);
  RigidTransform T_world_imu_;
  std::filesystem::path path_;
  estimation::MapMatchSet set_;
};

TEST_F(MapMatcherTest, GivesWorldPointsOfTheNodeThatLooksTheSameWay) {
  const map::MapFile map(path_);
  for (const char* name : {"mutual", "guided"}) {
    config_.matcher = name;
    const FrameReport report = matcher(map).match(7, image_, prediction(), set_);
    ASSERT_EQ(report.verdict, FrameVerdict::kOk) << name;
    EXPECT_EQ(report.node_count, 1);
    EXPECT_EQ(report.node_ids[0], 0U);
    EXPECT_EQ(report.guided, config_.matcher == "guided");
    EXPECT_GT(report.matches, 0.6 * report.features);
    EXPECT_EQ(report.raw_matches - report.without_depth - report.behind_camera - report.outliers -
                  report.over_capacity,
              report.matches);
    EXPECT_EQ(set_.frame_time_ns, 7);
    EXPECT_EQ(set_.match_count, report.matches);
    EXPECT_NEAR(set_.nodes[0].covariance(0, 0), 1e-4, 1e-10);
    expect_true_matches(set_);
  }
}

TEST_F(MapMatcherTest, GuidedFallsBackWhereThePredictionIsSurerThanItIsRight) {
  config_.matcher = "guided";
  const map::MapFile map(path_);
  PosePrediction wrong = prediction();
  wrong.T_world_imu.R *= so3::exp({0.0, 0.0, 0.15});  // 68 px, claimed: 5 px
  wrong.covariance = testing::pose_covariance(1e-3, 0.01);
  const FrameReport report = matcher(map).match(7, image_, wrong, set_);
  ASSERT_EQ(report.verdict, FrameVerdict::kOk);
  EXPECT_FALSE(report.guided);
  expect_true_matches(set_);
}

TEST_F(MapMatcherTest, WithLeastEffortLooksAtTheMiddleRowsOnly) {
  const map::MapFile map(path_);
  MapMatcher matcher = this->matcher(map);
  ASSERT_EQ(matcher.least_effort(), Effort::kBand) << "make setup makes the model for it";
  const FrameReport full = matcher.match(7, image_, prediction(), set_, Effort::kGuided);
  const FrameReport report = matcher.match(7, image_, prediction(), set_, Effort::kBand);
  ASSERT_EQ(report.verdict, FrameVerdict::kOk);
  EXPECT_TRUE(report.guided);
  EXPECT_LT(report.features, full.features);
  EXPECT_GT(report.matches, 0.3 * full.matches);
  expect_true_matches(set_);
  for (int i = 0; i < set_.match_count; ++i) {
    const double row = set_.matches[static_cast<std::size_t>(i)].pixel_px.y();
    EXPECT_GE(row, image_.rows / 4.0);
    EXPECT_LE(row, 3.0 * image_.rows / 4.0);
  }
}

TEST_F(MapMatcherTest, MakesDoWithTheWholeImageWhereThereIsNoModelForLess) {
  const std::filesystem::path models = std::filesystem::path(path_).replace_extension("models");
  std::filesystem::create_directory(models);
  const std::string file = "xfeat_640x384_n512.onnx";
  std::filesystem::copy(default_model_dir() / file, models / file);
  config_.model_dir = models;
  {
    const map::MapFile map(path_);
    MapMatcher matcher = this->matcher(map);
    EXPECT_EQ(matcher.least_effort(), Effort::kGuided);
    EXPECT_EQ(matcher.match(7, image_, prediction(), set_, Effort::kBand).verdict,
              FrameVerdict::kOk);
  }
  std::filesystem::remove_all(models);
}

TEST_F(MapMatcherTest, SaysWhyAFrameGaveNoMatches) {
  const map::MapFile map(path_);
  MapMatcher matcher = this->matcher(map);
  const auto verdict = [&](const cv::Mat& image, const PosePrediction& p) {
    set_.match_count = 99;
    const FrameVerdict v = matcher.match(7, image, p, set_).verdict;
    EXPECT_EQ(set_.match_count, 0);
    return v;
  };
  PosePrediction far = prediction();
  far.T_world_imu.p.x() += 100.0;
  EXPECT_EQ(verdict(image_, far), FrameVerdict::kNoNodeNear);
  PosePrediction across = prediction();
  across.T_world_imu.R *= so3::exp({0.0, 0.0, 1.57});
  EXPECT_EQ(verdict(image_, across), FrameVerdict::kNoNodeNear);
  PosePrediction nan = prediction();
  nan.T_world_imu.p.x() = std::nan("");
  EXPECT_EQ(verdict(image_, nan), FrameVerdict::kBadPrediction);
  EXPECT_EQ(verdict(cv::Mat(), prediction()), FrameVerdict::kBadImage);
  EXPECT_EQ(verdict(cv::Mat(384, 641, CV_8UC1), prediction()), FrameVerdict::kBadImage);
  EXPECT_EQ(verdict(cv::Mat(image_.size(), CV_8UC1, cv::Scalar(90)), prediction()),
            FrameVerdict::kTooFewFeatures);
  EXPECT_EQ(verdict(patchwork(2), prediction()), FrameVerdict::kTooFewMatches);
}

TEST_F(MapMatcherTest, TakesTheNextNodeWhereTheNearestIsDamaged) {
  damage_node_0();
  const map::MapFile map(path_);
  ASSERT_FALSE(map.node_intact(0));
  const FrameReport report = matcher(map).match(7, image_, prediction(), set_);
  EXPECT_EQ(report.verdict, FrameVerdict::kOk);
  EXPECT_EQ(report.damaged_nodes, 1);
  ASSERT_EQ(report.node_count, 1);
  EXPECT_EQ(report.node_ids[0], 2U);
  expect_true_matches(set_);
}

TEST_F(MapMatcherTest, RefusesAMapOfAnotherModel) {
  const map::MapFile map(path_);
  if (!std::filesystem::exists(default_model_dir() / "xfeat_640x384_n1024.onnx")) {
    GTEST_SKIP() << "no second model";
  }
  config_.max_features = 1024;
  EXPECT_THROW(matcher(map), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::matching

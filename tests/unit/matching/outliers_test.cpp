// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/outliers.hpp"

#include "support/matching_scene.hpp"

#include <numeric>

#include <gtest/gtest.h>

namespace topoloc::matching {
namespace {

using testing::Random;
using testing::test_camera;

int count(const std::vector<std::uint8_t>& keep, int begin, int end) {
  return std::accumulate(keep.begin() + begin, keep.begin() + end, 0);
}

/// `good` matches seen from a camera moved against the prediction, then `bad` ones anywhere.
std::vector<MatchGeometry> matches(Random& random, int good, int bad,
                                   const RigidTransform& T_predicted_cam) {
  const PinholeCamera camera = test_camera();
  std::vector<MatchGeometry> out;
  while (static_cast<int>(out.size()) < good + bad) {
    const Eigen::Vector2d pixel(random.uniform(0, 639), random.uniform(0, 383));
    const Eigen::Vector3d q_cam = 4.0 * std::exp(random.uniform(0.0, 2.5)) * camera.ray(pixel);
    const Eigen::Vector3d q = T_predicted_cam * q_cam;
    MatchGeometry match{.pixel_px = pixel + Eigen::Vector2d(random.normal(0.5), random.normal(0.5)),
                        .predicted_px = camera.project(q),
                        .predicted_std_px = 450.0 * (0.3 / q.z() + 0.01),
                        .q_cam_m = q};
    if (static_cast<int>(out.size()) >= good) {
      match.pixel_px = {random.uniform(0, 639), random.uniform(0, 383)};
    }
    out.push_back(match);
  }
  return out;
}

RigidTransform small_motion() { return {so3::exp({0.01, -0.015, 0.005}), {0.2, -0.1, 0.25}}; }

TEST(PaperOutliers, KeepsWhatIsWithinThreeSigmaOfTheMeanShiftPerAxis) {
  std::vector<MatchGeometry> set(5);
  // Shifts 10, 10, 10, 10 and 60 px: the mean is 20.
  for (std::size_t i = 0; i < set.size(); ++i) {
    set[i].predicted_px = {i == 4 ? 60.0 : 10.0, 0.0};
  }
  std::vector<std::uint8_t> keep;
  keep_near_mean_shift(set, 4.0, keep);  // limit 12 px
  EXPECT_EQ(keep, (std::vector<std::uint8_t>{1, 1, 1, 1, 0}));
  keep_near_mean_shift(set, 3.0, keep);  // limit 9 px: the outlier has moved the mean too far
  EXPECT_EQ(keep, (std::vector<std::uint8_t>{0, 0, 0, 0, 0}));
  keep_near_median_shift(set, 5.0, 4.0, keep);  // which the median does not let it
  EXPECT_EQ(keep, (std::vector<std::uint8_t>{1, 1, 1, 1, 0}));
}

TEST(RobustOutliers, RejectFortyPercentGrossOutliers) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    const auto set = matches(random, 180, 120, small_motion());
    std::vector<std::uint8_t> keep;
    remove_outliers(set, test_camera(), {.method = "robust"}, keep);
    EXPECT_GE(count(keep, 0, 180), 170) << seed;
    EXPECT_LE(count(keep, 180, 300), 3) << seed;
  }
}

TEST(RobustOutliers, ConsensusPoseIsTheTrueOneAndKeepsNearPoints) {
  Random random(1);
  const auto set = matches(random, 200, 100, small_motion());
  std::vector<std::uint8_t> keep(set.size(), 1);
  const auto T = keep_pose_consensus(set, test_camera(), {}, keep);
  ASSERT_TRUE(T);
  EXPECT_LT((T->p - small_motion().p).norm(), 0.03);
  EXPECT_LT(so3::log(T->R.transpose() * small_motion().R).norm(), 0.002);
}

TEST(RobustOutliers, TheMedianStageKeepsNearPointsThatShiftFar) {
  // A sideways error of 0.3 m moves a point at 4 m by 34 px and most others by less than 10.
  std::vector<MatchGeometry> set;
  for (int i = 0; i < 50; ++i) {
    const double depth_m = i < 5 ? 4.0 : 40.0 + i;
    set.push_back(
        {.predicted_px = {450.0 * 0.3 / depth_m, 0.0}, .predicted_std_px = 450.0 * 0.3 / depth_m});
  }
  std::vector<std::uint8_t> keep;
  keep_near_median_shift(set, 5.0, 4.0, keep);
  EXPECT_EQ(count(keep, 0, 50), 50);
}

TEST(RobustOutliers, SameInputGivesTheSameOutput) {
  Random random(2);
  const auto set = matches(random, 100, 100, small_motion());
  std::vector<std::uint8_t> first;
  std::vector<std::uint8_t> second;
  remove_outliers(set, test_camera(), {}, first);
  remove_outliers(set, test_camera(), {}, second);
  EXPECT_EQ(first, second);
}

TEST(RobustOutliers, MatchesAtRandomLeaveAlmostNothing) {
  Random random(3);
  const auto set = matches(random, 0, 200, {});
  std::vector<std::uint8_t> keep;
  remove_outliers(set, test_camera(), {}, keep);
  EXPECT_LT(count(keep, 0, 200), 12);
}

TEST(Outliers, NonFinitePixelsAndPointsAreRemovedAndMoveNothing) {
  for (const char* method : {"paper", "robust"}) {
    Random random(4);
    auto set = matches(random, 60, 0, small_motion());
    set[0].pixel_px.x() = std::nan("");
    set[1].predicted_px.y() = std::numeric_limits<double>::infinity();
    std::vector<std::uint8_t> keep;
    remove_outliers(set, test_camera(), {.method = method, .sigma_th_px = 50.0}, keep);
    EXPECT_EQ(count(keep, 0, 2), 0) << method;
    EXPECT_GE(count(keep, 2, 60), 55) << method;
  }
}

TEST(Outliers, TheMethodNoneKeepsAll) {
  Random random(5);
  const auto set = matches(random, 10, 90, small_motion());
  std::vector<std::uint8_t> keep;
  remove_outliers(set, test_camera(), {.method = "none"}, keep);
  EXPECT_EQ(keep, std::vector<std::uint8_t>(100, 1));
}

TEST(Outliers, NoneOneOrDegenerateMatchesAreNoError) {
  for (const char* method : {"paper", "robust"}) {
    std::vector<std::uint8_t> keep{1, 1};
    remove_outliers({}, test_camera(), {.method = method}, keep);
    EXPECT_TRUE(keep.empty());
    const std::vector<MatchGeometry> one(1);
    remove_outliers(one, test_camera(), {.method = method}, keep);
    EXPECT_EQ(keep.size(), 1U);
    // Twenty times the same point.
    const std::vector<MatchGeometry> same(
        20, {.pixel_px = {300, 200}, .predicted_px = {300, 200}, .q_cam_m = {0, 0, 5}});
    remove_outliers(same, test_camera(), {.method = method}, keep);
    EXPECT_EQ(keep.size(), 20U);
  }
}

}  // namespace
}  // namespace topoloc::matching

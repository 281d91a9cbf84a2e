// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/guided_matcher.hpp"

#include "topoloc/matching/mutual_nearest_matcher.hpp"
#include "topoloc/matching/outliers.hpp"

#include "support/matching_scene.hpp"

#include <algorithm>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace topoloc::matching {
namespace {

using testing::Random;
using testing::Scene;
using testing::test_camera;
using testing::test_T_imu_cam;

constexpr double kDegree = std::numbers::pi / 180.0;

int correct(const Scene& scene, const std::vector<FeatureMatch>& matches) {
  return static_cast<int>(std::count_if(matches.begin(), matches.end(), [&](const auto& m) {
    return scene.truth[static_cast<std::size_t>(m.query)] == m.node;
  }));
}

std::vector<MatchGeometry> geometry_of(const Scene& scene, const PredictedCamera& camera,
                                       const std::vector<FeatureMatch>& matches) {
  std::vector<MatchGeometry> out;
  for (const FeatureMatch& m : matches) {
    const Eigen::Vector3d& p = scene.points[static_cast<std::size_t>(m.node)];
    const ProjectedPoint predicted = camera.project(p);
    out.push_back(
        {.pixel_px = scene.query.pixels_px[static_cast<std::size_t>(m.query)].cast<double>(),
         .predicted_px = predicted.pixel_px,
         .predicted_std_px = std::sqrt(predicted.covariance.trace()),
         .q_cam_m = camera.T_world_cam().inverse() * p});
  }
  return out;
}

/// The true pose moved by 0.3 m and turned by 1 degree in directions that change with the seed.
PosePrediction wrong_prediction(const Scene& scene, Random& random) {
  const Eigen::Vector3d shift = 0.3 * random.vector(1.0).normalized();
  const Eigen::Vector3d turn = kDegree * random.vector(1.0).normalized();
  return {{scene.T_world_imu_true.R * so3::exp(turn), scene.T_world_imu_true.p + shift},
          testing::pose_covariance(kDegree / 1.7, 0.3 / 1.7)};
}

TEST(GuidedMatcher, RecoversMatchesWithAWrongPredictionWhereFreeMatchingIsLost) {
  Random random(1);
  const Scene scene(random, 300, 400);
  const PredictedCamera camera(test_camera(), test_T_imu_cam(), wrong_prediction(scene, random));
  GuidedMatcher guided({.ratio = 1.0}, 0.7, 1.0);
  std::vector<FeatureMatch> matches;
  ASSERT_TRUE(guided.match(scene.query, scene.node, scene.project(camera), matches));
  std::vector<FeatureMatch> free;
  MutualNearestMatcher(0.7).match(scene.query, scene.node, free);
  EXPECT_GT(correct(scene, matches), 230);
  EXPECT_GT(correct(scene, matches), correct(scene, free) + 20);
}

TEST(GuidedMatcher, DoesNotPullThePoseTowardsThePrediction) {
  double left_m = 0.0;
  double left_rad = 0.0;
  constexpr int kSeeds = 10;
  for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
    Random random(seed);
    const Scene scene(random, 250, 500);
    const PosePrediction prediction = wrong_prediction(scene, random);
    const PredictedCamera camera(test_camera(), test_T_imu_cam(), prediction);
    GuidedMatcher guided({}, 0.7, 1.0);
    std::vector<FeatureMatch> matches;
    ASSERT_TRUE(guided.match(scene.query, scene.node, scene.project(camera), matches));
    const auto geometry = geometry_of(scene, camera, matches);
    const OutlierConfig config;
    std::vector<std::uint8_t> keep;
    keep_near_median_shift(geometry, config.median_sigmas, config.consensus_px, keep);
    const auto T_predicted_cam = keep_pose_consensus(geometry, test_camera(), config, keep);
    ASSERT_TRUE(T_predicted_cam);
    const RigidTransform T_world_imu =
        camera.T_world_cam() * *T_predicted_cam * test_T_imu_cam().inverse();
    left_m += (T_world_imu.p - scene.T_world_imu_true.p).norm() / kSeeds;
    left_rad += so3::log(scene.T_world_imu_true.R.transpose() * T_world_imu.R).norm() / kSeeds;
  }
  EXPECT_LT(left_m, 0.1 * 0.3);
  EXPECT_LT(left_rad, 0.1 * kDegree);
}

TEST(GuidedMatcher, GateIsThatOfTheInnovationWithDepthInIt) {
  // One point, one feature 40 px away: inside the gate if the point is near, outside if it is far.
  const RigidTransform T_world_imu;
  const PredictedCamera camera(test_camera(), test_T_imu_cam(),
                               {T_world_imu, testing::pose_covariance(1e-4, 0.3)});
  for (const auto& [depth_m, expected] : {std::pair{5.0, 1}, std::pair{50.0, 0}}) {
    Random random(3);
    const Eigen::VectorXf d = random.descriptor(64);
    FeatureSet query(1, 64);
    FeatureSet node(1, 64);
    query.width_px = 640;
    query.height_px = 384;
    testing::append(query, {340.0, 200.0}, d);
    testing::append(node, {340.0, 200.0}, d);
    const Eigen::Vector3d q = depth_m * test_camera().ray({300.0, 200.0});
    const std::vector<ProjectedPoint> points{camera.project(test_T_imu_cam() * q)};
    std::vector<FeatureMatch> matches;
    ASSERT_TRUE(GuidedMatcher({}, 0.8, 1.0).match(query, node, points, matches));
    EXPECT_EQ(static_cast<int>(matches.size()), expected) << depth_m;
  }
}

TEST(GuidedMatcher, RefusesToGuideWithAWeakPrediction) {
  Random random(4);
  const Scene scene(random, 100, 0);
  const PredictedCamera camera(test_camera(), test_T_imu_cam(),
                               {scene.T_world_imu_true, testing::pose_covariance(0.2, 3.0)});
  std::vector<FeatureMatch> matches{{1, 1, 1.0F}};
  EXPECT_FALSE(
      GuidedMatcher({}, 0.7, 1.0).match(scene.query, scene.node, scene.project(camera), matches));
  EXPECT_TRUE(matches.empty());
}

TEST(GuidedMatcher, PointsBehindOrOutsideAndPixelsThatAreNotNumbersDoNotMatch) {
  Random random(5);
  Scene scene(random, 50, 0);
  const PredictedCamera camera(test_camera(), test_T_imu_cam(),
                               {scene.T_world_imu_true, testing::pose_covariance(1e-3, 0.01)});
  const RigidTransform T_world_cam = camera.T_world_cam();
  scene.points[0] = T_world_cam * Eigen::Vector3d(0.0, 0.0, -5.0);  // behind
  scene.points[1] = T_world_cam * Eigen::Vector3d(1e9, 0.0, 0.2);   // far outside
  scene.points[2] = Eigen::Vector3d::Constant(std::nan(""));        // not a number
  scene.query.pixels_px[3].x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(camera.project(scene.points[0]).visible);
  EXPECT_FALSE(camera.project(scene.points[2]).visible);
  std::vector<FeatureMatch> matches;
  ASSERT_TRUE(
      GuidedMatcher({}, 0.7, 1.0).match(scene.query, scene.node, scene.project(camera), matches));
  EXPECT_EQ(correct(scene, matches), 46);
  EXPECT_EQ(matches.size(), 46U);
}

TEST(GuidedMatcher, EmptySetsGiveNoMatches) {
  Random random(6);
  const Scene scene(random, 20, 0);
  const PredictedCamera camera(test_camera(), test_T_imu_cam(),
                               {scene.T_world_imu_true, testing::pose_covariance(1e-3, 0.01)});
  GuidedMatcher guided({}, 0.7, 1.0);
  std::vector<FeatureMatch> matches;
  EXPECT_TRUE(guided.match(FeatureSet(4, 64), scene.node, scene.project(camera), matches));
  EXPECT_TRUE(matches.empty());
  EXPECT_TRUE(guided.match(scene.query, FeatureSet(4, 64), {}, matches));
  EXPECT_TRUE(matches.empty());
  EXPECT_THROW(guided.match(scene.query, scene.node, {}, matches), std::invalid_argument);
}

TEST(PredictedCamera, CovarianceIsThatOfPerturbedPoses) {
  Random random(7);
  const PosePrediction prediction{{so3::exp({0.1, -0.2, 0.9}), {5.0, -3.0, 1.0}},
                                  Eigen::Matrix<double, 6, 6>::Identity()};
  const PredictedCamera camera(test_camera(), test_T_imu_cam(), prediction);
  const Eigen::Vector3d p_world = camera.T_world_cam() * Eigen::Vector3d(2.0, -1.0, 9.0);
  Eigen::Matrix<double, 2, 6> J;
  constexpr double kStep = 1e-6;
  for (int axis = 0; axis < 6; ++axis) {
    Eigen::Vector2d pixels[2];
    for (const int side : {0, 1}) {
      Eigen::Matrix<double, 6, 1> d = Eigen::Matrix<double, 6, 1>::Zero();
      d[axis] = side == 0 ? -kStep : kStep;
      PosePrediction moved = prediction;
      moved.T_world_imu.R *= so3::exp(d.head<3>());
      moved.T_world_imu.p += d.tail<3>();
      pixels[side] =
          PredictedCamera(test_camera(), test_T_imu_cam(), moved).project(p_world).pixel_px;
    }
    J.col(axis) = (pixels[1] - pixels[0]) / (2.0 * kStep);
  }
  const Eigen::Matrix2d expected = J * J.transpose();
  EXPECT_LT((camera.project(p_world).covariance - expected).norm(), 1e-4 * expected.norm());
}

}  // namespace
}  // namespace topoloc::matching

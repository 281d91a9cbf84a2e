// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/guided_matcher.hpp"
#include "topoloc/matching/mutual_nearest_matcher.hpp"

#include "support/matching_scene.hpp"

#include <filesystem>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>

// Times do not depend on what the images show: noise and made-up scenes will do.
namespace topoloc::matching {
namespace {

constexpr double kMinSimilarity = 0.7;

/// Arguments: width, height, features, threads.
void extract_xfeat(benchmark::State& state) {
  MatchingConfig config;
  config.width_px = static_cast<int>(state.range(0));
  config.height_px = static_cast<int>(state.range(1));
  config.max_features = static_cast<int>(state.range(2));
  config.threads = static_cast<int>(state.range(3));
  cv::Mat image(config.height_px, config.width_px, CV_8UC1);
  cv::setRNGSeed(1);
  cv::randu(image, 0, 255);
  try {
    const auto extractor = make_extractor(config);
    FeatureSet out;
    for (auto _ : state) {
      extractor->extract(image, out);
    }
  } catch (const std::runtime_error& error) {
    state.SkipWithError(error.what());
  }
}
BENCHMARK(extract_xfeat)
    ->ArgsProduct({{640, 1248}, {384}, {512, 1024}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// Arguments: features, threads.
void match_lighterglue(benchmark::State& state) {
  MatchingConfig config;
  config.max_features = static_cast<int>(state.range(0));
  config.threads = static_cast<int>(state.range(1));
  testing::Random random(1);
  const testing::Scene scene(random, config.max_features, 0);
  try {
    const auto matcher = make_matcher(config);
    std::vector<FeatureMatch> out;
    for (auto _ : state) {
      matcher->match(scene.query, scene.node, out);
    }
  } catch (const std::runtime_error& error) {
    state.SkipWithError(error.what());
  }
}
BENCHMARK(match_lighterglue)
    ->ArgsProduct({{512, 1024}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void match_mutual_nearest(benchmark::State& state) {
  testing::Random random(1);
  const testing::Scene scene(random, static_cast<int>(state.range(0)), 0);
  MutualNearestMatcher matcher(kMinSimilarity);
  std::vector<FeatureMatch> out;
  for (auto _ : state) {
    matcher.match(scene.query, scene.node, out);
  }
}
BENCHMARK(match_mutual_nearest)->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond);

/// Projection of the points and matching, prediction known to 0.3 m and 1 degree.
void match_guided(benchmark::State& state) {
  testing::Random random(1);
  const testing::Scene scene(random, static_cast<int>(state.range(0)), 0);
  GuidedMatcher matcher({}, kMinSimilarity, 1.0);
  std::vector<FeatureMatch> out;
  for (auto _ : state) {
    const PredictedCamera camera(testing::test_camera(), testing::test_T_imu_cam(),
                                 {scene.T_world_imu_true, testing::pose_covariance(0.017, 0.3)});
    matcher.match(scene.query, scene.node, scene.project(camera), out);
  }
}
BENCHMARK(match_guided)->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace topoloc::matching

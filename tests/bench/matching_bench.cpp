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
void extract(benchmark::State& state, const char* extractor) {
  MatchingConfig config;
  config.extractor = extractor;
  config.width_px = static_cast<int>(state.range(0));
  config.height_px = static_cast<int>(state.range(1));
  config.max_features = static_cast<int>(state.range(2));
  config.threads = static_cast<int>(state.range(3));
  cv::Mat image(config.height_px, config.width_px, CV_8UC1);
  cv::setRNGSeed(1);
  cv::randu(image, 0, 255);
  try {
    const auto network = make_extractor(config);
    FeatureSet out;
    for (auto _ : state) {
      network->extract(image, out);
    }
  } catch (const std::runtime_error& error) {
    state.SkipWithError(error.what());
  }
}
BENCHMARK_CAPTURE(extract, xfeat, "xfeat")
    ->ArgsProduct({{640, 1248}, {384}, {512, 1024}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(extract, aliked_n16, "aliked-n16")
    ->ArgsProduct({{640, 1248}, {384}, {512, 1024}, {2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(extract, disk, "disk")
    ->ArgsProduct({{640}, {384}, {512}, {2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// Arguments: features, threads.
void match_network(benchmark::State& state, const char* extractor, const char* matcher,
                   int descriptor_dim) {
  MatchingConfig config;
  config.extractor = extractor;
  config.matcher = matcher;
  config.max_features = static_cast<int>(state.range(0));
  config.threads = static_cast<int>(state.range(1));
  testing::Random random(1);
  const testing::Scene scene(random, config.max_features, 0, descriptor_dim);
  try {
    const auto network = make_matcher(config);
    std::vector<FeatureMatch> out;
    for (auto _ : state) {
      network->match(scene.query, scene.node, out);
    }
  } catch (const std::runtime_error& error) {
    state.SkipWithError(error.what());
  }
}
BENCHMARK_CAPTURE(match_network, lighterglue, "xfeat", "lighterglue", 64)
    ->ArgsProduct({{512, 1024}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(match_network, lightglue, "aliked-n16", "lightglue", 128)
    ->ArgsProduct({{512, 1024}, {2}})
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

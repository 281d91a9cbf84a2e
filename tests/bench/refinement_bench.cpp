// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/config.hpp"
#include "topoloc/refinement/trajectory_refiner.hpp"

#include "unit/refinement/textured_street.hpp"

#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>

namespace {

using topoloc::PinholeCamera;
using topoloc::RigidTransform;
using topoloc::refinement::GradientField;
using topoloc::refinement::RefinementConfig;
using topoloc::refinement::TexturedStreet;
using topoloc::refinement::ViewCorrelation;

constexpr int kFirstPass = 2;  // shrinks by that
constexpr int kLaterPasses = 1;

/// Of refinement: `camera_scale` times the default matching camera.
PinholeCamera camera() {
  const double s = RefinementConfig().camera_scale;
  const PinholeCamera base = topoloc::matching::matching_camera({});
  const int width_px = static_cast<int>(base.width_px * s);
  const int height_px = static_cast<int>(base.height_px * s);
  return {width_px,
          height_px,
          base.fx_px * s,
          base.fy_px * s,
          0.5 * (width_px - 1),
          0.5 * (height_px - 1)};
}

/// A view of a made-up street, and what a camera there would show.
struct View {
  RigidTransform T_world_imu;
  RigidTransform T_world_cam;
  topoloc::mapping::RenderedView rendered;
  cv::Mat image;
  cv::Mat mask;

  explicit View(double x_m)
      : T_world_imu(TexturedStreet::vehicle_at(x_m)),
        T_world_cam(T_world_imu * TexturedStreet::T_imu_cam()) {
    static const topoloc::mapping::CloudGrid cloud = TexturedStreet(1).scan();
    const RefinementConfig config;
    rendered = topoloc::mapping::render(cloud, camera(), T_world_cam, config.render);
    topoloc::mapping::average_intensity(cloud, T_world_cam, config.render, rendered);
    const cv::Size size(rendered.camera.width_px, rendered.camera.height_px);
    cv::Mat(size, CV_32FC1, rendered.intensity.data()).convertTo(image, CV_8U);
    mask = cv::Mat(size, CV_8UC1, cv::Scalar(255));
  }

  [[nodiscard]] ViewCorrelation correlated(int shrink) const {
    const RefinementConfig config;
    const GradientField seen = camera_gradients(image, mask, config.gradients);
    return correlate(seen, intensity_gradients(rendered, config.gradients), rendered, T_world_cam,
                     shrink, config.correlation);
  }
};

void correlate_view(benchmark::State& state) {
  const View view(0.0);
  std::size_t patches = 0;
  for (auto _ : state) {
    patches = view.correlated(static_cast<int>(state.range(0))).patches.size();
  }
  state.counters["patches"] = static_cast<double>(patches);
}
BENCHMARK(correlate_view)
    ->ArgName("shrink")
    ->Arg(kFirstPass)
    ->Arg(kLaterPasses)
    ->Unit(benchmark::kMillisecond);

/// A window of the usual number of views, on so many threads.
void register_window(benchmark::State& state) {
  RefinementConfig config;
  config.search.threads = static_cast<int>(state.range(1));
  std::vector<RigidTransform> poses;
  std::vector<ViewCorrelation> correlations;
  for (std::size_t i = 0; i < config.window.views; ++i) {
    const View view(config.window.view_m * static_cast<double>(i));
    poses.push_back(view.T_world_imu);
    correlations.push_back(view.correlated(static_cast<int>(state.range(0))));
  }
  std::vector<topoloc::refinement::WindowView> window;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    window.push_back({&correlations[i], poses[i]});
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(topoloc::refinement::register_window(
        window, poses[poses.size() / 2], TexturedStreet::T_imu_cam(), camera(), config.search));
  }
}
BENCHMARK(register_window)
    ->ArgNames({"shrink", "threads"})
    ->ArgsProduct({{kFirstPass, kLaterPasses}, {1, 2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace

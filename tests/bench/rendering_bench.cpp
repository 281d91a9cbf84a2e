// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/rendering/camera_renderer.hpp"
#include "topoloc/rendering/lidar.hpp"

#include <cstddef>
#include <optional>
#include <vector>

#include <benchmark/benchmark.h>

namespace {

using namespace topoloc;
using namespace topoloc::rendering;

constexpr double kAlong_m = 120.0;

/// 300 m of town with its parked cars and traffic.
struct Scene {
  world::World world = world::make_world({world::Scenario::kTown, 1, 300.0});
  world::Visit visit{world, {}};
  Raycaster raycaster{world, visit.parked()};
  double left_m = world.lanes(kAlong_m).front().left_m;

  Scene() { raycaster.place_moving(visit.moving(10.0, kAlong_m, left_m)); }

  [[nodiscard]] RigidTransform T_world_cam(double along_m) const {
    RigidTransform T_road_cam;
    T_road_cam.R << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
    T_road_cam.p = {0.0, left_m, 1.5};
    return world.route.T_world_road(along_m) * T_road_cam;
  }
};

const Scene& town() {
  static const Scene scene;
  return scene;
}

PinholeCamera camera() { return {640, 400, 450.0, 450.0, 319.5, 199.5}; }

/// Four rays to a pixel, as images are made of.
void cast_rays(benchmark::State& state) {
  const Scene& scene = town();
  const RigidTransform T = scene.T_world_cam(kAlong_m);
  std::vector<Ray> rays;
  for (int y = 0; y < camera().height_px; ++y) {
    for (int i = 0; i < 4 * camera().width_px; ++i) {
      rays.push_back({T.p, T.R * camera().ray({0.25 * i - 0.375, y}).normalized()});
    }
  }
  std::vector<std::optional<Hit>> hits(rays.size());
  for ([[maybe_unused]] const auto step : state) {
    scene.raycaster.cast(rays, hits);
    benchmark::DoNotOptimize(hits.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(rays.size()));
}
BENCHMARK(cast_rays)->Unit(benchmark::kMillisecond);

/// A frame on one thread, while driving 1 m from one to the next.
void camera_frame(benchmark::State& state) {
  const Scene& scene = town();
  CameraSpec spec;
  spec.calibration.pinhole = camera();
  CameraRenderer renderer(scene.raycaster, spec, static_cast<Light>(state.range(0)), 1, 1);
  std::uint64_t frame = 0;
  const auto render = [&] {
    const double along_m = kAlong_m + static_cast<double>(frame % 100);
    return renderer.render(
        [&](double time_s) { return scene.T_world_cam(along_m + 10.0 * time_s); }, frame++);
  };
  render();  // most of the light from all sides
  for ([[maybe_unused]] const auto step : state) {
    benchmark::DoNotOptimize(render().data);
  }
}
BENCHMARK(camera_frame)
    ->ArgName("light")
    ->Arg(static_cast<int>(Light::kDay))
    ->Arg(static_cast<int>(Light::kNight))
    ->Unit(benchmark::kMillisecond)
    ->Iterations(10);

/// One turn of 64 beams and 1800 columns, on one thread.
void lidar_turn(benchmark::State& state) {
  const Scene& scene = town();
  std::uint64_t key = 0;
  for ([[maybe_unused]] const auto step : state) {
    benchmark::DoNotOptimize(scan(
        scene.raycaster, LidarSpec{},
        [&](double time_s) {
          RigidTransform T = scene.world.route.T_world_road(kAlong_m + 10.0 * time_s);
          T.p = T * Eigen::Vector3d(0.0, scene.left_m, 1.9);
          return T;
        },
        key++, 1));
  }
}
BENCHMARK(lidar_turn)->Unit(benchmark::kMillisecond);

/// Traffic put anew, as before each frame.
void place_moving(benchmark::State& state) {
  Scene scene;
  const auto moving = scene.visit.moving(10.0, kAlong_m, scene.left_m);
  for ([[maybe_unused]] const auto step : state) {
    scene.raycaster.place_moving(moving);
  }
  state.counters["vehicles"] = static_cast<double>(moving.size());
}
BENCHMARK(place_moving)->Unit(benchmark::kMillisecond);

}  // namespace

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
// How long the estimator's parts take. Figures and commands: docs/benchmarks.md.
#include "support/straight_drive.hpp"

#include <benchmark/benchmark.h>

namespace topoloc::estimation {
namespace {

using test::Random;
using test::StraightDrive;

void propagation_step(benchmark::State& state) {
  const ImuNoise noise;
  const InertialInput u{.specific_force_mps2 = {0.1, 0.2, 9.8},
                        .angular_rate_radps = {0.01, 0.02, 0.1}};
  NominalState x;
  Covariance P = 1e-4 * Covariance::Identity();
  for (auto _ : state) {
    propagate_covariance(x, u, noise, 0.005, P);
    x = propagate_state(x, u, 0.005);
    benchmark::DoNotOptimize(P.data());
    if (x.p_world_imu.squaredNorm() > 1e6) {  // keep the numbers in their usual range
      x = NominalState{};
      P = 1e-4 * Covariance::Identity();
    }
  }
}
BENCHMARK(propagation_step);

/// Iterated update forced to five iterations; arguments: matches, nodes with covariance (0 or 1).
void map_update_5_iterations(benchmark::State& state) {
  const StraightDrive drive;
  MapUpdateConfig config;
  config.max_iterations = 5;
  config.convergence_theta_rad = 0.0;
  config.convergence_p_m = 0.0;
  MapUpdate update(drive.camera, config);
  MapMatchSet set;
  drive.matches(0.0, static_cast<int>(state.range(0)), set);
  set.nodes[0].covariance.diagonal().setConstant(state.range(1) != 0 ? 1e-4 : 0.0);
  NominalState prior;
  prior.p_world_imu = {0.3, -0.2, 0.1};
  Covariance P_prior = 1e-4 * Covariance::Identity();
  P_prior.diagonal().segment<3>(error_index::kP).setConstant(0.25);
  for (auto _ : state) {
    NominalState x = prior;
    Covariance P = P_prior;
    const MapUpdateResult result = update.apply(set, x, P);
    if (result.verdict != MapVerdict::kAccepted || result.iterations != 5) {
      state.SkipWithError("the update was not made with five iterations");
      break;
    }
    benchmark::DoNotOptimize(x);
  }
}
BENCHMARK(map_update_5_iterations)
    ->ArgNames({"matches", "node_covariance"})
    ->Args({1024, 0})
    ->Args({1024, 1})
    ->Args({2048, 1})
    ->Unit(benchmark::kMicrosecond);

/// An estimator that has driven for two seconds, IMU at 200 Hz and speeds at 100 Hz.
struct DrivingEstimator {
  DrivingEstimator() : estimator(config(drive)) {
    while (tick < 400) {
      step();
    }
  }
  static EstimatorConfig config(const StraightDrive& drive) {
    EstimatorConfig c;
    c.models.camera = drive.camera;
    return c;
  }
  void step() {
    const double t = 0.005 * static_cast<double>(tick);
    const ImuSample imu = StraightDrive::imu(t);
    const SpeedSample speed = drive.speed(t);
    TickInputs inputs{.imu = {&imu, 1},
                      .speed = {&speed, tick % 2 == 0 ? 1U : 0U},
                      .matches = {},
                      .initial_pose = {}};
    if (tick == 0) {
      inputs.initial_pose = InitialPose{.time_ns = imu.time_ns, .T_world_imu = drive.pose(0.0)};
    }
    benchmark::DoNotOptimize(&estimator.tick(imu.time_ns, inputs));
    ++tick;
  }
  StraightDrive drive;
  Estimator estimator;
  std::int64_t tick = 0;
};

void tick_without_update(benchmark::State& state) {
  DrivingEstimator driving;
  for (auto _ : state) {
    driving.step();
  }
}
BENCHMARK(tick_without_update)->Unit(benchmark::kMicrosecond);

/// A match set of sixteen matches that arrives 0.5 s late: 100 IMU samples and 50 speeds again.
void go_back_half_a_second(benchmark::State& state) {
  DrivingEstimator driving;
  MapMatchSet set;
  for (auto _ : state) {
    state.PauseTiming();
    driving.step();  // moves on, so that no two sets have the same time
    const double now = 0.005 * static_cast<double>(driving.tick - 1);
    driving.drive.matches(now - 0.5, 16, set);
    const MapMatchSet* late = &set;
    state.ResumeTiming();
    benchmark::DoNotOptimize(&driving.estimator.tick(
        StraightDrive::at(now),
        {.imu = {}, .speed = {}, .matches = {&late, 1}, .initial_pose = {}}));
  }
}
BENCHMARK(go_back_half_a_second)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace topoloc::estimation

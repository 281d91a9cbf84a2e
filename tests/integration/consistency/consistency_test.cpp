// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
// Monte-Carlo consistency: is the error as large as the covariance says? (NEES, Bar-Shalom)
#include "topoloc/estimation/estimator.hpp"
#include "topoloc/estimation/map_update.hpp"
#include "topoloc/estimation/speed_measurement.hpp"

#include "support/landmark_world.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <map>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace topoloc::estimation {
namespace {

using namespace error_index;
using Eigen::Vector3d;
using test::ImuSimulator;
using test::LandmarkWorld;
using test::Random;

constexpr std::uint64_t kSeed = 20261122;
constexpr int kRuns = 200;
constexpr double kImuRate_hz = 200.0;
constexpr int kSteps = 4000;  // 20 s, two stops
constexpr int kMatches = 40;
constexpr ImuNoise kNoise{};

const std::vector<LandmarkWorld::Truth>& truth() {
  static const auto all = [] {
    const LandmarkWorld world(kSeed);
    std::vector<LandmarkWorld::Truth> t;
    for (int i = 0; i <= kSteps; ++i) {
      t.push_back(world.at(i / kImuRate_hz));
    }
    return t;
  }();
  return all;
}

struct Options {
  RobustKernel kernel = RobustKernel::kNone;
  double match_gate_chi2 = 1e6;  ///< consistent Gaussian noise: a gate would cut its tails off
  double node_std_m = 0.0;       ///< error of every node's position, drawn once a run
  bool tell_node_covariance = true;
  MapWander wander{.share = 0.0};  ///< of the map against the ground
  bool tell_wander = true;
};

/// What the map is moved by against the ground: a share of the way that changes along it.
struct WanderingMap {
  Vector3d share = Vector3d::Zero();
  Vector3d velocity_mps = Vector3d::Zero();
  Vector3d offset_m = Vector3d::Zero();

  void advance(const MapWander& model, double speed_mps, double dt_s, Random& random) {
    const double kept = std::exp(-speed_mps * dt_s / model.length_m);
    share = kept * share + model.share * std::sqrt(1.0 - kept * kept) * random.normal_vector<3>();
    velocity_mps = speed_mps * share;
    offset_m += dt_s * velocity_mps;
  }
};

struct Part {
  const char* name;
  int at;
  int size;
  bool drawn_once;  ///< its error hardly changes within a run: all frames are one sample
};
constexpr std::array<Part, 6> kParts = {{{"pose", kTheta, 6, false},
                                         {"attitude", kTheta, 3, false},
                                         {"position", kP, 3, false},
                                         {"velocity", kV, 3, false},
                                         {"accel bias", kBa, 3, true},
                                         {"gyro bias", kBg, 3, true}}};

/// Mean NEES over the runs, at each frame, by part of the state.
using Anees = std::array<std::vector<double>, kParts.size()>;

Covariance initial_covariance() {
  ErrorVector std;
  std.segment<3>(kTheta).setConstant(0.03);
  std.segment<3>(kP).setConstant(0.5);
  std.segment<3>(kV).setConstant(0.3);
  std.segment<3>(kBa).setConstant(0.1);
  std.segment<3>(kBg).setConstant(0.005);
  std.segment<3>(kG).setConstant(0.02);
  return std.cwiseAbs2().asDiagonal();
}

void simulate_run(const LandmarkWorld& world, const Options& options, std::uint64_t seed,
                  Anees& anees) {
  Random random(seed);
  MapUpdateConfig config;
  config.kernel = options.kernel;
  config.match_gate_chi2 = options.match_gate_chi2;
  config.kernel_width_sigma = options.kernel == RobustKernel::kNone ? 100.0 : 2.0;
  config.pose_gate_chi2 = 1e6;
  MapUpdate update({.pinhole = world.camera.pinhole, .T_cam_imu = world.camera.T_cam_imu}, config);
  SpeedModel speed;
  speed.R_vehicle_imu = world.R_vehicle_imu;
  speed.wheel_reference_imu_m = world.wheel_reference_imu_m;
  const double gyro_std_radps = kNoise.gyro_noise_density * std::sqrt(kImuRate_hz);

  // The truth is fixed; what is drawn is the filter's initial error, and the true biases and
  // gravity with it.
  Covariance P = initial_covariance();
  NominalState actual;
  actual.R_world_imu = truth()[0].T_world_imu.R;
  actual.p_world_imu = truth()[0].T_world_imu.p;
  actual.v_world_imu = truth()[0].v_world_imu;
  NominalState x =
      boxplus(actual, P.diagonal().cwiseSqrt().cwiseProduct(random.normal_vector<kErrorDim>()));
  ImuSimulator imu(kNoise, kImuRate_hz, Vector3d::Zero(), Vector3d::Zero());
  std::map<int, Vector3d> node_errors;  // by node number, drawn when first seen
  std::map<int, int> node_uses;
  WanderingMap map;
  map.share = options.wander.share * random.normal_vector<3>();
  const bool wanders = options.wander.share > 0.0;
  // The speed's error is then the wander: as good as constant from one sample to the next.
  const double independent_share = wanders ? 0.02 / speed.correlation_s : 1.0;

  MapMatchSet set;
  InertialInput last = imu.sample(truth()[0], actual.gravity_mps2, random);
  for (int i = 1; i <= kSteps; ++i) {
    const LandmarkWorld::Truth& now = truth()[static_cast<std::size_t>(i)];
    const InertialInput next = imu.sample(now, actual.gravity_mps2, random);
    const InertialInput u{
        .specific_force_mps2 = 0.5 * (last.specific_force_mps2 + next.specific_force_mps2),
        .angular_rate_radps = 0.5 * (last.angular_rate_radps + next.angular_rate_radps)};
    const ImuNoise noise =
        options.tell_wander ? with_wander(kNoise, options.wander, x.v_world_imu.norm()) : kNoise;
    propagate_covariance(x, u, noise, 1.0 / kImuRate_hz, P);
    x = propagate_state(x, u, 1.0 / kImuRate_hz);
    last = next;
    if (wanders) {
      map.advance(options.wander, now.v_world_imu.norm(), 1.0 / kImuRate_hz, random);
    }

    if (i % 4 == 0) {  // wheel speed at 50 Hz, each row wrong by its own normal deviate
      const Vector3d scatter =
          (wanders ? 0.0 : 1.0) *
          linearise_speed(x, speed, next.angular_rate_radps, 0.0, now.speed_mps)
              .R.diagonal()
              .cwiseSqrt()
              .cwiseProduct(random.normal_vector<3>());
      update_with_vector<3>(
          [&](const NominalState& x_k) {
            auto m =
                linearise_speed(x_k, speed, next.angular_rate_radps, gyro_std_radps, now.speed_mps);
            m.z += scatter;
            return m;
          },
          1e6, x, P, independent_share);
    }
    if (i % 20 != 0) {
      continue;
    }
    world.observe(now.T_world_imu, kMatches, 1.0, random, set);
    set.node_count = 1;
    set.nodes[0] = MatchedNode{};
    set.nodes[0].R_world_cam = now.T_world_imu.R;
    set.nodes[0].p_world_cam = now.T_world_imu.p;
    for (int m = 0; m < set.match_count; ++m) {
      set.matches[static_cast<std::size_t>(m)].p_world_m += map.offset_m;
    }
    set.nodes[0].p_world_cam += map.offset_m;
    if (options.node_std_m > 0.0) {
      const int node = static_cast<int>(std::floor(now.T_world_imu.p.x() / 5.0));
      if (!node_errors.contains(node)) {
        node_errors[node] = options.node_std_m * random.normal_vector<3>();
      }
      for (int m = 0; m < set.match_count; ++m) {
        set.matches[static_cast<std::size_t>(m)].p_world_m -= node_errors[node];
      }
      if (options.tell_node_covariance) {
        const double variance = options.node_std_m * options.node_std_m;
        set.nodes[0].covariance.diagonal().tail<3>().setConstant(
            variance * node_reuse_factor(node_uses[node]++));
      }
    }
    update.apply(set, x, P);

    actual.R_world_imu = now.T_world_imu.R;
    actual.p_world_imu = now.T_world_imu.p + map.offset_m;
    actual.v_world_imu = now.v_world_imu + map.velocity_mps;
    actual.accel_bias_mps2 = imu.accel_bias_mps2;
    actual.gyro_bias_radps = imu.gyro_bias_radps;
    const ErrorVector error = boxminus(actual, x);
    const auto frame = static_cast<std::size_t>(i / 20 - 1);
    for (std::size_t part = 0; part < kParts.size(); ++part) {
      const auto e = error.segment(kParts[part].at, kParts[part].size);
      const Eigen::MatrixXd S =
          P.block(kParts[part].at, kParts[part].at, kParts[part].size, kParts[part].size);
      anees[part][frame] += e.dot(S.llt().solve(e)) / kRuns;
    }
  }
}

Anees simulate(const Options& options) {
  std::printf("seed %llu, %d runs\n", static_cast<unsigned long long>(kSeed), kRuns);
  const LandmarkWorld world(kSeed);
  Anees anees;
  anees.fill(std::vector<double>(kSteps / 20, 0.0));
  for (int run = 0; run < kRuns; ++run) {
    simulate_run(world, options, kSeed + static_cast<std::uint64_t>(run) + 1, anees);
  }
  return anees;
}

/// Quantile of chi-square over its degrees of freedom (Wilson and Hilferty; 1e-4 at this many).
double chi2_quantile(double dof, double normal_quantile) {
  const double a = 2.0 / (9.0 * dof);
  return std::pow(1.0 - a + normal_quantile * std::sqrt(a), 3.0);
}

struct Summary {
  double mean;       ///< over time, divided by the dimension: 1 is consistent
  double inside;     ///< share of frames within the 95 % bounds
  double low, high;  ///< the bounds of one frame, divided by the dimension
};

Summary summarise(const Anees& anees, std::size_t part) {
  const double n = kParts[part].size;
  const double low = n * chi2_quantile(n * kRuns, -1.95996);
  const double high = n * chi2_quantile(n * kRuns, 1.95996);
  double sum = 0.0;
  double inside = 0.0;
  for (const double value : anees[part]) {
    sum += value;
    inside += value >= low && value <= high ? 1.0 : 0.0;
  }
  const auto frames = static_cast<double>(anees[part].size());
  const Summary s{
      .mean = sum / frames / n, .inside = inside / frames, .low = low / n, .high = high / n};
  std::printf("  %-10s ANEES / dimension %.3f, inside 95 %% bounds [%.3f, %.3f]: %.1f %%\n",
              kParts[part].name, s.mean, s.low, s.high, 100.0 * s.inside);
  return s;
}

TEST(Consistency, ErrorsAreAsLargeAsTheCovarianceSays) {
  const Anees anees = simulate({});
  for (std::size_t part = 0; part < kParts.size(); ++part) {
    const Summary s = summarise(anees, part);
    EXPECT_GE(s.mean, s.low) << kParts[part].name;
    EXPECT_LE(s.mean, s.high) << kParts[part].name;
    if (!kParts[part].drawn_once) {
      EXPECT_GE(s.inside, 0.9) << kParts[part].name;
      EXPECT_NEAR(s.mean, 1.0, 0.05) << kParts[part].name;
    }
  }
}

// With normal noise, robust weights give information away: the filter is a little too modest in
// its weights and cuts tails off. Reported; asserted only not to be far off.
TEST(Consistency, RobustKernelStaysNearConsistency) {
  const Anees anees = simulate({.kernel = RobustKernel::kCauchy, .match_gate_chi2 = 13.8});
  for (std::size_t part = 0; part < kParts.size(); ++part) {
    const Summary s = summarise(anees, part);
    EXPECT_GT(s.mean, 0.5) << kParts[part].name;
    EXPECT_LT(s.mean, 1.5) << kParts[part].name;
  }
}

TEST(Consistency, NodeErrorsAreAccountedFor) {
  const Summary told = summarise(simulate({.node_std_m = 0.1, .tell_node_covariance = true}), 2);
  EXPECT_GT(told.mean, 0.3);
  EXPECT_LT(told.mean, 1.3);
  const Summary untold = summarise(simulate({.node_std_m = 0.1, .tell_node_covariance = false}), 2);
  EXPECT_GT(untold.mean, 5.0) << "the errors must be large enough to matter";
}

// A vehicle in a map that moves against the ground: neither IMU nor wheels feel it.
TEST(Consistency, AMapThatWandersIsAccountedFor) {
  constexpr MapWander kWander{.share = 0.02, .length_m = 16.0};
  const Anees told = simulate({.wander = kWander});
  const Anees untold = simulate({.wander = kWander, .tell_wander = false});
  for (const std::size_t part : {std::size_t{2}, std::size_t{3}}) {  // position, velocity
    const Summary with = summarise(told, part);
    EXPECT_GT(with.mean, 0.3) << kParts[part].name;
    EXPECT_LT(with.mean, 1.5) << kParts[part].name;
    EXPECT_GT(summarise(untold, part).mean, 2.0 * with.mean) << kParts[part].name;
  }
}

}  // namespace
}  // namespace topoloc::estimation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/imu.hpp"

#include "topoloc/can/dbc.hpp"
#include "topoloc/estimation/propagation.hpp"
#include "topoloc/geometry/so3.hpp"
#include "topoloc/simulation/bus.hpp"
#include "topoloc/world/world.hpp"

#include "unit/simulation/toy_road.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::simulation {
namespace {

using estimation::ImuSample;
using testing::highway_road;
using testing::town_road;
using testing::ToyRoad;

const RigidTransform& mounting() {
  static const RigidTransform T = built_mounting(3).T_vehicle_imu;
  return T;
}

estimation::NominalState state_of(const BodyMotion& motion) {
  estimation::NominalState x;
  x.R_world_imu = motion.T_world_body.R;
  x.p_world_imu = motion.T_world_body.p;
  x.v_world_imu = motion.velocity_mps;
  x.gravity_mps2 = {0.0, 0.0, -9.81};
  return x;
}

/// As the estimator does it: the mean of two neighbours holds between them.
estimation::NominalState stepped(const estimation::NominalState& x, const ImuSample& a,
                                 const ImuSample& b) {
  const estimation::InertialInput u{
      .specific_force_mps2 = 0.5 * (a.specific_force_mps2 + b.specific_force_mps2),
      .angular_rate_radps = 0.5 * (a.angular_rate_radps + b.angular_rate_radps)};
  return propagate_state(x, u, static_cast<double>(b.time_ns - a.time_ns) * 1e-9);
}

/// Samples as a receiver reads them off the bus.
std::vector<ImuSample> over_the_bus(const std::vector<ImuSample>& samples) {
  const can::Dbc dbc = can::Dbc::parse(dbc_text(), "dbc");
  const auto frames = put_on_bus(samples, {}, 0, BusSpec::ideal(), 1);
  const auto triad = [&](const can::Frame& frame, const std::string& name) {
    Eigen::Vector3d result;
    for (int axis = 0; axis < 3; ++axis) {
      const can::SignalRef found = dbc.signal(name + "_" + "XYZ"[axis]);
      result[axis] = can::decode(found.signal->coding, frame.payload()).value();
    }
    return result;
  };
  std::vector<ImuSample> result;
  for (std::size_t i = 0; i + 1 < frames.size(); i += 2) {
    result.push_back({.time_ns = frames[i].time_ns,
                      .specific_force_mps2 = triad(frames[i], "IMU_ACCEL.ACCEL"),
                      .angular_rate_radps = triad(frames[i + 1], "IMU_RATE.RATE")});
  }
  return result;
}

/// Worst errors on the way, not only at its end.
struct Drift {
  double position_m = 0.0;
  double velocity_mps = 0.0;
  double rotation_rad = 0.0;
};

Drift drift_of(const std::vector<ImuSample>& samples, const Ego& ego) {
  constexpr std::size_t kEnd = 6000;
  Drift drift;
  estimation::NominalState x = state_of(ego.trajectory.at(0.0).of(mounting()));
  for (std::size_t i = 0; i < kEnd; ++i) {
    x = stepped(x, samples[i], samples[i + 1]);
    const BodyMotion truth = ego.trajectory.at(0.01 * static_cast<double>(i + 1)).of(mounting());
    const auto rotation = so3::log(truth.T_world_body.R.transpose() * x.R_world_imu);
    drift.position_m = std::max(drift.position_m, (x.p_world_imu - truth.T_world_body.p).norm());
    drift.velocity_mps = std::max(drift.velocity_mps, (x.v_world_imu - truth.velocity_mps).norm());
    drift.rotation_rad = std::max(drift.rotation_rad, rotation.norm());
  }
  return drift;
}

void expect_the_trajectory(const Ego& ego) {
  ASSERT_GT(ego.duration_s(), 60.0);
  const auto samples = sense_motion(ego.trajectory, mounting(), ImuSpec::ideal(), 1);
  for (const bool bus : {false, true}) {
    SCOPED_TRACE(bus ? "over the bus" : "samples");
    const Drift drift = drift_of(bus ? over_the_bus(samples) : samples, ego);
    EXPECT_LT(drift.position_m, 0.01);
    EXPECT_LT(drift.velocity_mps, 0.002);
    EXPECT_LT(drift.rotation_rad, 2e-5);
  }
}

TEST(Imu, IdealSamplesReproduceTheTrajectoryWithin1cmOver60s) {
  for (const bool town : {true, false}) {
    SCOPED_TRACE(town ? "town" : "highway");
    const ToyRoad toy = town ? town_road() : highway_road();
    expect_the_trajectory(drive_along(toy.road, {}, 5));
  }
}

TEST(Imu, IdealSamplesReproduceDrivesThroughMadeWorldsToo) {
  using world::Scenario;
  for (const Scenario scenario : {Scenario::kTown, Scenario::kHighway, Scenario::kTunnel}) {
    SCOPED_TRACE(world::name(scenario));
    const world::World made =
        world::make_world({.scenario = scenario, .seed = 6, .length_m = 1800.0});
    expect_the_trajectory(drive_along(road_of(made), {}, 5));
  }
}

/// Allan deviation of a sequence for groups of `size` samples.
double allan_deviation(const std::vector<double>& values, std::size_t size) {
  std::vector<double> means;
  for (std::size_t i = 0; i + size <= values.size(); i += size) {
    double sum = 0.0;
    for (std::size_t j = i; j < i + size; ++j) {
      sum += values[j];
    }
    means.push_back(sum / static_cast<double>(size));
  }
  double squares = 0.0;
  for (std::size_t i = 0; i + 1 < means.size(); ++i) {
    squares += (means[i + 1] - means[i]) * (means[i + 1] - means[i]);
  }
  return std::sqrt(0.5 * squares / static_cast<double>(means.size() - 1));
}

/// A vehicle that stands for an hour.
Trajectory standing(double duration_s) {
  std::vector<RigidTransform> poses(static_cast<std::size_t>(duration_s) + 4);
  return {std::move(poses), 1.0};
}

TEST(Imu, NoiseHasTheDensitiesThatItsFileStates) {
  ImuSpec spec;
  spec.engine_mps2 = 0.0;
  const auto samples = sense_motion(standing(2000.0), mounting(), spec, 17);
  for (int axis = 0; axis < 3; ++axis) {
    SCOPED_TRACE(axis);
    std::vector<double> force;
    std::vector<double> rate;
    for (const ImuSample& sample : samples) {
      force.push_back(sample.specific_force_mps2[axis]);
      rate.push_back(sample.angular_rate_radps[axis]);
    }
    // White noise: density = Allan deviation at tau x sqrt(tau).
    EXPECT_NEAR(allan_deviation(force, 20) * std::sqrt(0.2), spec.noise.accel_noise_density,
                0.05 * spec.noise.accel_noise_density);
    EXPECT_NEAR(allan_deviation(rate, 20) * std::sqrt(0.2), spec.noise.gyro_noise_density,
                0.05 * spec.noise.gyro_noise_density);
  }
}

TEST(Imu, BiasesWalkAsItsFileStates) {
  ImuSpec spec = ImuSpec::ideal();
  spec.noise.accel_random_walk = 4e-4;
  spec.noise.gyro_random_walk = 1.1e-5;
  double force = 0.0;
  double rate = 0.0;
  constexpr int kRuns = 40;
  constexpr double kDuration_s = 60.0;
  for (std::uint64_t run = 0; run < kRuns; ++run) {
    const auto samples = sense_motion(standing(kDuration_s), RigidTransform{}, spec, run);
    const Eigen::Vector3d up(0.0, 0.0, 9.81);
    force += (samples.back().specific_force_mps2 - up).squaredNorm();
    rate += samples.back().angular_rate_radps.squaredNorm();
  }
  const double root_s = std::sqrt(kDuration_s);
  EXPECT_NEAR(std::sqrt(force / (3 * kRuns)) / root_s, 4e-4, 8e-5);
  EXPECT_NEAR(std::sqrt(rate / (3 * kRuns)) / root_s, 1.1e-5, 2.2e-6);
}

TEST(Imu, StartsWithABiasThatEachDriveHasOfItsOwn) {
  ImuSpec spec = ImuSpec::ideal();
  spec.accel_bias_mps2 = 0.1;
  spec.gyro_bias_radps = 0.005;
  const Trajectory still = standing(1.0);
  const ImuSample ideal = sense_motion(still, mounting(), ImuSpec::ideal(), 1).front();
  constexpr int kDrives = 200;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();
  for (std::uint64_t drive = 0; drive < kDrives; ++drive) {
    const auto samples = sense_motion(still, mounting(), spec, drive);
    const Eigen::Vector3d bias = samples.front().specific_force_mps2 - ideal.specific_force_mps2;
    force += bias.cwiseAbs2() / kDrives;
    rate += samples.front().angular_rate_radps.cwiseAbs2() / kDrives;
    EXPECT_LT((samples.back().specific_force_mps2 - samples.front().specific_force_mps2).norm(),
              1e-9);  // it stays
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(std::sqrt(force[axis]), 0.1, 0.02) << axis;
    EXPECT_NEAR(std::sqrt(rate[axis]), 0.005, 0.001) << axis;
  }
}

/// A vehicle that turns about its z axis.
Trajectory turning(double rate_radps) {
  std::vector<RigidTransform> poses;
  for (int i = 0; i < 10; ++i) {
    poses.push_back({so3::exp({0.0, 0.0, 0.1 * rate_radps * i}), Eigen::Vector3d::Zero()});
  }
  return {std::move(poses), 0.1};
}

TEST(Imu, ScaleAndAxesAreOffByWhatIsStated) {
  ImuSpec spec = ImuSpec::ideal();
  spec.scale_error = 0.005;
  spec.misalignment_rad = 0.003;
  const Trajectory turn = turning(0.5);
  constexpr int kSensors = 200;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();
  for (std::uint64_t sensor = 0; sensor < kSensors; ++sensor) {
    spec.sensor = sensor;
    const ImuSample sample = sense_motion(turn, RigidTransform{}, spec, 1).front();
    const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
    force += (sample.specific_force_mps2 / 9.81 - z).cwiseAbs2() / kSensors;
    rate += (sample.angular_rate_radps / 0.5 - z).cwiseAbs2() / kSensors;
  }
  for (const Eigen::Vector3d& squares : {force, rate}) {
    EXPECT_NEAR(std::sqrt(squares.x()), 0.003, 0.0006);
    EXPECT_NEAR(std::sqrt(squares.y()), 0.003, 0.0006);
    EXPECT_NEAR(std::sqrt(squares.z()), 0.005, 0.001);
  }
}

TEST(Imu, ScaleAndAxesStayWithTheSensorFromDriveToDrive) {
  ImuSpec spec = ImuSpec::ideal();
  spec.scale_error = 0.005;
  spec.misalignment_rad = 0.003;
  const Trajectory turn = turning(0.5);
  const auto measured = [&](std::uint64_t sensor, std::uint64_t drive) {
    spec.sensor = sensor;
    return sense_motion(turn, mounting(), spec, drive).back();
  };
  const ImuSample first = measured(1, 1);
  const ImuSample next = measured(1, 2);
  const ImuSample other = measured(2, 1);
  EXPECT_EQ(first.specific_force_mps2, next.specific_force_mps2);
  EXPECT_EQ(first.angular_rate_radps, next.angular_rate_radps);
  EXPECT_GT((first.specific_force_mps2 - other.specific_force_mps2).norm(), 1e-3);
  EXPECT_GT((first.angular_rate_radps - other.angular_rate_radps).norm(), 1e-4);
}

TEST(Imu, VibrationGoesNowhere) {
  const ToyRoad toy = town_road();
  const Ego ego = drive_along(toy.road, {}, 5);
  const ImuSpec real;
  ImuSpec shaking = ImuSpec::ideal();
  shaking.engine_mps2 = real.engine_mps2;
  shaking.road_mps2_per_mps = real.road_mps2_per_mps;
  shaking.road_radps_per_mps = real.road_radps_per_mps;
  const auto samples = sense_motion(ego.trajectory, mounting(), shaking, 1);
  const auto quiet = sense_motion(ego.trajectory, mounting(), ImuSpec::ideal(), 1);
  double squares = 0.0;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  double fastest = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Vector3d shake = samples[i].specific_force_mps2 - quiet[i].specific_force_mps2;
    squares += shake.squaredNorm();
    velocity += 0.01 * shake;
    fastest = std::max(fastest, velocity.norm());
  }
  EXPECT_GT(std::sqrt(squares / static_cast<double>(samples.size())), 0.05);
  EXPECT_LT(fastest, 0.02);
}

TEST(Imu, StandingVehicleIsQuietEnoughToBeKnown) {
  const auto samples = sense_motion(standing(10.0), mounting(), ImuSpec{}, 4);
  Eigen::Vector3d low = samples.front().specific_force_mps2;
  Eigen::Vector3d high = low;
  for (const ImuSample& sample : samples) {
    low = low.cwiseMin(sample.specific_force_mps2);
    high = high.cwiseMax(sample.specific_force_mps2);
  }
  EXPECT_LT((high - low).maxCoeff(), 0.4);  // StandstillModel::max_force_span_mps2 is 0.6
}

}  // namespace
}  // namespace topoloc::simulation

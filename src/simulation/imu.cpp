// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/imu.hpp"

#include "topoloc/world/random.hpp"

#include "simulation/normal3.hpp"
#include "simulation/vibration.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace topoloc::simulation {
namespace {

constexpr double kGravity_mps2 = 9.81;

/// One triad of accelerometers or gyroscopes.
class Triad {
 public:
  struct Errors {
    double density;
    double random_walk;
    double bias;
    double scale;
    double misalignment_rad;
  };
  /// `sensor`: key of what stays with the part, `drive`: of what each drive has of its own.
  Triad(const Errors& errors, double rate_hz, std::uint64_t sensor, std::uint64_t drive)
      : random_(drive),
        white_(errors.density * std::sqrt(rate_hz)),
        step_(errors.random_walk / std::sqrt(rate_hz)),
        bias_(errors.bias * normal3(random_)) {
    world::Random part(sensor);
    gain_ = Eigen::Matrix3d::Identity();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        gain_(row, column) +=
            (row == column ? errors.scale : errors.misalignment_rad) * part.normal();
      }
    }
  }

  Eigen::Vector3d measure(const Eigen::Vector3d& value) {
    const Eigen::Vector3d measured = gain_ * value + bias_ + white_ * normal3(random_);
    bias_ += step_ * normal3(random_);
    return measured;
  }

 private:
  world::Random random_;
  double white_;
  double step_;
  Eigen::Vector3d bias_;
  Eigen::Matrix3d gain_;
};

/// The engine's shaking and the road's, by axis: three of force, three of rate.
class Vibration {
 public:
  Vibration(const ImuSpec& spec, std::uint64_t key)
      : spec_(spec), random_(key), rattles_{Rattle(14.0, 0.15, spec.rate_hz),
                                            Rattle(17.0, 0.2, spec.rate_hz),
                                            Rattle(11.0, 0.2, spec.rate_hz),
                                            Rattle(12.0, 0.2, spec.rate_hz),
                                            Rattle(15.0, 0.2, spec.rate_hz),
                                            Rattle(18.0, 0.2, spec.rate_hz)} {}

  void step(double speed_mps) {
    // Four cylinders: two strokes a turn; gears of 7 m/s each keep the engine below 50 turns/s.
    const double in_gear = std::fmod(std::abs(speed_mps), 7.0) / 7.0;
    const double turns_hz = std::abs(speed_mps) < 1.0 ? 13.0 : 20.0 + 22.0 * in_gear;
    phase_ += 2.0 * std::numbers::pi * 2.0 * turns_hz / spec_.rate_hz;
    const double engine = spec_.engine_mps2 * (turns_hz / 13.0) * std::sin(phase_);
    for (int i = 0; i < 6; ++i) {
      const auto rattle = static_cast<std::size_t>(i);
      shaking_[rattle] = rattles_[rattle].next(random_.normal());
    }
    const double road = spec_.road_mps2_per_mps * std::abs(speed_mps);
    force_ = road * Eigen::Vector3d(0.5 * shaking_[0], 0.5 * shaking_[1], shaking_[2]) +
             engine * Eigen::Vector3d(0.4, 0.3, 1.0);
    rate_ = spec_.road_radps_per_mps * std::abs(speed_mps) *
            Eigen::Vector3d(shaking_[3], shaking_[4], 0.5 * shaking_[5]);
  }
  [[nodiscard]] const Eigen::Vector3d& force_mps2() const { return force_; }
  [[nodiscard]] const Eigen::Vector3d& rate_radps() const { return rate_; }

 private:
  ImuSpec spec_;
  world::Random random_;
  std::array<Rattle, 6> rattles_;
  std::array<double, 6> shaking_{};
  double phase_ = 0.0;
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_ = Eigen::Vector3d::Zero();
};

}  // namespace

ImuSpec ImuSpec::ideal() {
  return {.noise = {.accel_noise_density = 0.0,
                    .gyro_noise_density = 0.0,
                    .accel_random_walk = 0.0,
                    .gyro_random_walk = 0.0},
          .accel_bias_mps2 = 0.0,
          .gyro_bias_radps = 0.0,
          .scale_error = 0.0,
          .misalignment_rad = 0.0,
          .engine_mps2 = 0.0,
          .road_mps2_per_mps = 0.0,
          .road_radps_per_mps = 0.0};
}

estimation::ImuSample true_imu_sample(const BodyMotion& imu) {
  const Eigen::Vector3d up(0.0, 0.0, kGravity_mps2);
  return {.time_ns = 0,
          .specific_force_mps2 = imu.T_world_body.R.transpose() * (imu.acceleration_mps2 + up),
          .angular_rate_radps = imu.rate_radps};
}

std::vector<estimation::ImuSample> sense_motion(const Trajectory& vehicle,
                                                const RigidTransform& T_vehicle_imu,
                                                const ImuSpec& spec, std::uint64_t key) {
  Triad accelerometer({.density = spec.noise.accel_noise_density,
                       .random_walk = spec.noise.accel_random_walk,
                       .bias = spec.accel_bias_mps2,
                       .scale = spec.scale_error,
                       .misalignment_rad = spec.misalignment_rad},
                      spec.rate_hz, world::key(spec.sensor, {1}), world::key(key, {1}));
  Triad gyroscope({.density = spec.noise.gyro_noise_density,
                   .random_walk = spec.noise.gyro_random_walk,
                   .bias = spec.gyro_bias_radps,
                   .scale = spec.scale_error,
                   .misalignment_rad = spec.misalignment_rad},
                  spec.rate_hz, world::key(spec.sensor, {2}), world::key(key, {2}));
  Vibration vibration(spec, world::key(key, {3}));
  std::vector<estimation::ImuSample> samples;
  const auto count = static_cast<std::int64_t>(std::floor(vehicle.duration_s() * spec.rate_hz));
  samples.reserve(static_cast<std::size_t>(count + 1));
  for (std::int64_t i = 0; i <= count; ++i) {
    const double time_s = static_cast<double>(i) / spec.rate_hz;
    const BodyMotion body = vehicle.at(time_s);
    vibration.step(body.velocity_mps.norm());
    estimation::ImuSample sample = true_imu_sample(body.of(T_vehicle_imu));
    sample.time_ns = std::llround(time_s * 1e9);
    sample.specific_force_mps2 =
        accelerometer.measure(sample.specific_force_mps2 + vibration.force_mps2());
    sample.angular_rate_radps =
        gyroscope.measure(sample.angular_rate_radps + vibration.rate_radps());
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace topoloc::simulation

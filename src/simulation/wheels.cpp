// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/wheels.hpp"

#include "topoloc/world/random.hpp"

#include <cmath>

namespace topoloc::simulation {
namespace {

/// Spinning and locking of the driven (front) wheels: how much faster they turn than they roll.
class Slip {
 public:
  explicit Slip(std::uint64_t key) : random_(key), next_s_(random_.uniform(6.0, 12.0)) {}

  double share(double time_s, double forward_mps2) {
    if (time_s >= next_s_ && std::abs(forward_mps2) > 0.4) {
      until_s_ = time_s + random_.uniform(0.4, 1.2);
      share_ = forward_mps2 > 0.0 ? random_.uniform(0.08, 0.3) : -random_.uniform(0.08, 0.4);
      next_s_ = until_s_ + random_.uniform(8.0, 20.0);
    }
    return time_s < until_s_ ? share_ : 0.0;
  }

 private:
  world::Random random_;
  double next_s_;
  double until_s_ = 0.0;
  double share_ = 0.0;
};

}  // namespace

WheelSpec WheelSpec::ideal() {
  return {.radius_error = 0.0, .single_radius_error = 0.0, .noise_mps = 0.0, .dead_band_mps = 0.0};
}

std::array<double, 4> true_wheel_speeds(const BodyMotion& vehicle, const VehicleModel& model) {
  const Eigen::Vector3d velocity = vehicle.T_world_body.R.transpose() * vehicle.velocity_mps;
  const double forward = std::copysign(vehicle.velocity_mps.norm(), velocity.x());
  const double yaw_rate = vehicle.rate_radps.z();
  const double left = forward - yaw_rate * 0.5 * model.track_m;
  const double right = forward + yaw_rate * 0.5 * model.track_m;
  const double sideways = yaw_rate * model.wheelbase_m;
  return {std::copysign(std::hypot(left, sideways), left),
          std::copysign(std::hypot(right, sideways), right), left, right};
}

std::vector<WheelSample> sense_wheels(const Trajectory& vehicle, const VehicleModel& model,
                                      const WheelSpec& spec, std::uint64_t key) {
  world::Random random(world::key(key, {1}));
  const double common = spec.radius_error * random.normal();
  std::array<double, 4> scale{};
  for (double& wheel : scale) {
    wheel = 1.0 + common + spec.single_radius_error * random.normal();
  }
  Slip slip(world::key(key, {2}));
  std::vector<WheelSample> samples;
  const auto count = static_cast<std::int64_t>(std::floor(vehicle.duration_s() * spec.rate_hz));
  for (std::int64_t i = 0; i <= count; ++i) {
    const double time_s = static_cast<double>(i) / spec.rate_hz;
    const BodyMotion body = vehicle.at(time_s);
    WheelSample sample{.time_ns = std::llround(time_s * 1e9),
                       .speeds_mps = true_wheel_speeds(body, model)};
    const double forward_mps2 = (body.T_world_body.R.transpose() * body.acceleration_mps2).x();
    const double spin = spec.slip ? slip.share(time_s, forward_mps2) : 0.0;
    for (std::size_t wheel = 0; wheel < 4; ++wheel) {
      double& speed = sample.speeds_mps[wheel];
      const double noise = spec.noise_mps * random.normal();
      const bool driven = wheel == kFrontLeft || wheel == kFrontRight;
      speed *= scale[wheel] * (driven ? 1.0 + spin : 1.0);
      speed = std::abs(speed) < spec.dead_band_mps ? 0.0 : speed + (speed == 0.0 ? 0.0 : noise);
    }
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace topoloc::simulation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "simulation/suspension.hpp"

#include <numbers>

namespace topoloc::simulation {

Spring::Spring(double natural_hz, double damping)
    : omega_(2.0 * std::numbers::pi * natural_hz), damping_(damping) {}

double Spring::follow(double base, double dt_s) {
  const double base_speed = (base - base_) / dt_s;
  base_ = base;
  // Semi-implicit: stable and exact enough for steps of milliseconds.
  speed_ +=
      dt_s * (omega_ * omega_ * (base - value_) + 2.0 * damping_ * omega_ * (base_speed - speed_));
  value_ += dt_s * speed_;
  return value_;
}

void Spring::settle(double base) {
  base_ = value_ = base;
  speed_ = 0.0;
}

Suspension::Suspension(const VehicleModel& vehicle)
    : vehicle_(vehicle),
      heave_(vehicle.heave_hz, vehicle.damping),
      pitch_(vehicle.pitch_hz, vehicle.damping),
      roll_(vehicle.roll_hz, vehicle.damping) {}

Suspension::Targets Suspension::targets(const WheelHeights& road, double forward_mps2,
                                        double left_mps2) const {
  const double rear = 0.5 * (road.rear_left + road.rear_right);
  const double front = 0.5 * (road.front_left + road.front_right);
  const double left = 0.5 * (road.front_left + road.rear_left);
  const double right = 0.5 * (road.front_right + road.rear_right);
  return {.heave_m = rear,
          .pitch_rad =
              (rear - front) / vehicle_.wheelbase_m - vehicle_.pitch_rad_per_mps2 * forward_mps2,
          .roll_rad = (left - right) / vehicle_.track_m + vehicle_.roll_rad_per_mps2 * left_mps2};
}

void Suspension::settle(const WheelHeights& road, double forward_mps2, double left_mps2) {
  const Targets to = targets(road, forward_mps2, left_mps2);
  heave_.settle(to.heave_m);
  pitch_.settle(to.pitch_rad);
  roll_.settle(to.roll_rad);
}

void Suspension::step(const WheelHeights& road, double forward_mps2, double left_mps2,
                      double dt_s) {
  const Targets to = targets(road, forward_mps2, left_mps2);
  heave_.follow(to.heave_m, dt_s);
  pitch_.follow(to.pitch_rad, dt_s);
  roll_.follow(to.roll_rad, dt_s);
}

}  // namespace topoloc::simulation

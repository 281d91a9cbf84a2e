// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/simulation/vehicle_model.hpp"

namespace topoloc::simulation {

/// A mass on a spring and a damper over a moving base.
class Spring {
 public:
  Spring(double natural_hz, double damping);
  /// Value of the base after `dt_s`; returns that of the mass.
  double follow(double base, double dt_s);
  [[nodiscard]] double value() const { return value_; }
  /// At rest there.
  void settle(double base);

 private:
  double omega_;
  double damping_;
  double base_ = 0.0;
  double value_ = 0.0;
  double speed_ = 0.0;
};

/// Height of the road under the four wheels [m].
struct WheelHeights {
  double front_left = 0.0;
  double front_right = 0.0;
  double rear_left = 0.0;
  double rear_right = 0.0;
};

/// The body over its wheels.
class Suspension {
 public:
  explicit Suspension(const VehicleModel& vehicle);

  /// Accelerations: forward and to the left.
  void settle(const WheelHeights& road, double forward_mps2, double left_mps2);
  void step(const WheelHeights& road, double forward_mps2, double left_mps2, double dt_s);

  [[nodiscard]] double heave_m() const { return heave_.value(); }
  [[nodiscard]] double pitch_rad() const { return pitch_.value(); }  ///< positive: nose down
  [[nodiscard]] double roll_rad() const { return roll_.value(); }    ///< positive: left side up

 private:
  struct Targets {
    double heave_m;
    double pitch_rad;
    double roll_rad;
  };
  [[nodiscard]] Targets targets(const WheelHeights& road, double forward_mps2,
                                double left_mps2) const;

  VehicleModel vehicle_;
  Spring heave_;
  Spring pitch_;
  Spring roll_;
};

}  // namespace topoloc::simulation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

namespace topoloc::simulation {

/// Shaking that an IMU feels and that goes nowhere: a resonance of panels and tyres driven by
/// noise, of standard deviation 1. It is sampled without aliasing, so that its integral stays
/// small.
class Rattle {
 public:
  Rattle(double resonance_hz, double damping, double rate_hz);
  double next(double white);

 private:
  double gain_;
  double a1_;
  double a2_;
  double y1_ = 0.0;
  double y2_ = 0.0;
  double x1_ = 0.0;
};

}  // namespace topoloc::simulation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "simulation/vibration.hpp"

#include <cmath>
#include <numbers>

namespace topoloc::simulation {

// Second-order section with poles at the resonance and a zero at frequency 0.
Rattle::Rattle(double resonance_hz, double damping, double rate_hz) {
  const double turn = 2.0 * std::numbers::pi * resonance_hz / rate_hz;
  const double r = std::exp(-damping * turn);
  a1_ = 2.0 * r * std::cos(turn);
  a2_ = -r * r;
  // The energy of the impulse response is the variance of the output for white input.
  gain_ = 1.0;
  double energy = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const double y = next(i == 0 ? 1.0 : 0.0);
    energy += y * y;
  }
  gain_ = 1.0 / std::sqrt(energy);
  y1_ = y2_ = x1_ = 0.0;
}

double Rattle::next(double white) {
  const double y = a1_ * y1_ + a2_ * y2_ + white - x1_;
  y2_ = y1_;
  y1_ = y;
  x1_ = white;
  return gain_ * y;
}

}  // namespace topoloc::simulation

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace topoloc::refinement {

/// Standard normal numbers, the same for a seed whatever the standard library: it leaves open how
/// std::normal_distribution comes by them. Marsaglia's polar method.
class NormalSamples {
 public:
  explicit NormalSamples(std::uint64_t seed) : random_(seed) {}

  double operator()() {
    if (has_second_) {
      has_second_ = false;
      return second_;
    }
    double x = 0.0;
    double y = 0.0;
    double square = 0.0;
    do {
      x = between_minus_one_and_one();
      y = between_minus_one_and_one();
      square = x * x + y * y;
    } while (square > 1.0 || square == 0.0);
    const double scale = std::sqrt(-2.0 * std::log(square) / square);
    second_ = x * scale;
    has_second_ = true;
    return y * scale;
  }

 private:
  double between_minus_one_and_one() {
    constexpr double kShare = 0x1p-64;
    return 2.0 * (kShare * static_cast<double>(random_())) - 1.0;
  }

  std::mt19937_64 random_;  // the standard says what it gives
  double second_ = 0.0;     // they come in pairs
  bool has_second_ = false;
};

}  // namespace topoloc::refinement

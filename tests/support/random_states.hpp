// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/estimation/state.hpp"
#include "topoloc/geometry/so3.hpp"

#include <random>

namespace topoloc::test {

/// Reproducible normal deviates: the same sequence on every platform for one seed, which
/// std::normal_distribution does not promise.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(engine_() >> 11U) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Standard normal deviate (Box and Muller, one of the pair).
  double normal() {
    constexpr double kTwoPi = 6.283185307179586;
    return std::sqrt(-2.0 * std::log(1.0 - uniform())) * std::cos(kTwoPi * uniform());
  }
  template <int N>
  Eigen::Matrix<double, N, 1> normal_vector() {
    Eigen::Matrix<double, N, 1> v;
    for (int i = 0; i < N; ++i) {
      v[i] = normal();
    }
    return v;
  }
  Eigen::Matrix3d rotation() { return so3::exp(2.0 * normal_vector<3>()); }

 private:
  std::mt19937_64 engine_;
};

inline estimation::NominalState random_state(Random& random) {
  estimation::NominalState x;
  x.R_world_imu = random.rotation();
  x.p_world_imu = 10.0 * random.normal_vector<3>();
  x.v_world_imu = 5.0 * random.normal_vector<3>();
  x.accel_bias_mps2 = 0.2 * random.normal_vector<3>();
  x.gyro_bias_radps = 0.02 * random.normal_vector<3>();
  x.gravity_mps2 += 0.05 * random.normal_vector<3>();
  return x;
}

/// Positive definite, all states correlated, standard deviations of about `scale`.
inline estimation::Covariance random_covariance(Random& random, double scale) {
  estimation::Covariance A;
  for (int c = 0; c < estimation::kErrorDim; ++c) {
    A.col(c) = random.normal_vector<estimation::kErrorDim>();
  }
  return scale * scale *
         (A * A.transpose() / estimation::kErrorDim + 0.1 * estimation::Covariance::Identity());
}

/// Central differences of f : ErrorVector -> R^Rows at zero.
template <int Rows, typename F>
Eigen::Matrix<double, Rows, estimation::kErrorDim> central_differences(const F& f, double step) {
  Eigen::Matrix<double, Rows, estimation::kErrorDim> J;
  for (int i = 0; i < estimation::kErrorDim; ++i) {
    const estimation::ErrorVector d = step * estimation::ErrorVector::Unit(i);
    J.col(i) = (f(d) - f(-d)) / (2.0 * step);
  }
  return J;
}

}  // namespace topoloc::test

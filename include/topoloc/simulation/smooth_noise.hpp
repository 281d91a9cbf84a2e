// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>

#include <Eigen/Core>

namespace topoloc::simulation {

/// A smooth random function (twice continuously differentiable) of one variable: mean 0, standard
/// deviation about 1, values more than three spacings apart are independent. It can be asked
/// anywhere in any order: a cubic B-spline whose control values are drawn by their number.
class SmoothNoise {
 public:
  SmoothNoise(std::uint64_t key, double spacing) : key_(key), spacing_(spacing) {}

  [[nodiscard]] double value(double at) const;
  [[nodiscard]] double slope(double at) const;  ///< first derivative

 private:
  [[nodiscard]] Eigen::Vector4d controls(double at, double& share) const;

  std::uint64_t key_;
  double spacing_;
};

/// Three of them, independent.
class SmoothNoise3 {
 public:
  SmoothNoise3(std::uint64_t key, double spacing);
  [[nodiscard]] Eigen::Vector3d value(double at) const {
    return {x_.value(at), y_.value(at), z_.value(at)};
  }

 private:
  SmoothNoise x_;
  SmoothNoise y_;
  SmoothNoise z_;
};

}  // namespace topoloc::simulation

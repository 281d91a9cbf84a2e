// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/smooth_noise.hpp"

#include "topoloc/world/random.hpp"

#include "simulation/cubic_weights.hpp"

#include <cmath>

namespace topoloc::simulation {
namespace {

/// A B-spline averages its control values: their variance shrinks to 0.5 at the knots, 0.46
/// between them.
const double kGain = 1.0 / std::sqrt(0.48);

}  // namespace

Eigen::Vector4d SmoothNoise::controls(double at, double& share) const {
  const double place = at / spacing_;
  const double first = std::floor(place);
  share = place - first;
  Eigen::Vector4d values;
  for (int i = 0; i < 4; ++i) {
    const auto number = static_cast<std::int64_t>(first) + i;
    values[i] =
        kGain * world::Random(world::key(key_, {static_cast<std::uint64_t>(number)})).normal();
  }
  return values;
}

double SmoothNoise::value(double at) const {
  double share = 0.0;
  const Eigen::Vector4d values = controls(at, share);
  return values.dot(cubic_weights(share));
}

double SmoothNoise::slope(double at) const {
  double share = 0.0;
  const Eigen::Vector4d values = controls(at, share);
  return values.dot(cubic_weights_1(share)) / spacing_;
}

SmoothNoise3::SmoothNoise3(std::uint64_t key, double spacing)
    : x_(world::key(key, {0}), spacing),
      y_(world::key(key, {1}), spacing),
      z_(world::key(key, {2}), spacing) {}

}  // namespace topoloc::simulation

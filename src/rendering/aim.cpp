// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/aim.hpp"

#include "topoloc/world/random.hpp"

#include <cmath>

namespace topoloc::rendering {

/// Middle of a row's exposure.
double Aim::row_s(int row) const {
  return exposing_.readout_s * (static_cast<double>(row) / (exposing_.pinhole.height_px - 1) - 0.5);
}

Offset Aim::offset(int row, int column, std::size_t sample) const {
  const PixelSample& at = exposing_.samples[sample];
  // Times differ from pixel to pixel, else moving edges would show as often as there are samples.
  const std::uint64_t key =
      world::key(0x71DEU, {static_cast<std::uint64_t>(row), static_cast<std::uint64_t>(column)});
  const double shift = (world::Random(key).uniform() - 0.5) / static_cast<double>(samples());
  return {at.x - 0.5, at.y - 0.5, at.time + shift - 0.5};
}

Ray Aim::ray(int row, int column, const Offset& offset) const {
  const Eigen::Vector3d through = exposing_.lens->ray(column + offset.x, row + offset.y);
  const RigidTransform T = exposing_.path->at(row_s(row) + exposing_.exposure_s * offset.time);
  Ray ray;
  ray.origin_m = T.p;
  if (std::isnan(through.x())) {
    ray.max_m = 0.0;
  } else {
    ray.direction = (T.R * through).normalized();
  }
  return ray;
}

RayChange Aim::change(int row, int column) const {
  const RigidTransform begin = exposing_.path->at(row_s(row) - 0.5 * exposing_.exposure_s);
  const RigidTransform end = exposing_.path->at(row_s(row) + 0.5 * exposing_.exposure_s);
  const Eigen::Vector3d through = exposing_.lens->ray(column, row);
  const double length = through.norm();
  const Eigen::Vector3d sight = begin.R * through / length;
  const auto across = [&](const Eigen::Vector3d& moved) {  // a direction keeps its length
    return Eigen::Vector3d((moved - moved.dot(sight) * sight) / length);
  };
  return {across(begin.R * (exposing_.lens->ray(column + 1.0, row) - through)),
          across(begin.R * (exposing_.lens->ray(column, row + 1.0) - through)),
          across((end.R - begin.R) * through), end.p - begin.p};
}

}  // namespace topoloc::rendering

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/rendering/lidar.hpp"

#include "topoloc/world/random.hpp"

#include "rendering/parallel_rows.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <stdexcept>

namespace topoloc::rendering {
namespace {

Eigen::Vector3d beam_direction(double azimuth_rad, double elevation_rad) {
  return {std::cos(elevation_rad) * std::cos(azimuth_rad),
          std::cos(elevation_rad) * std::sin(azimuth_rad), std::sin(elevation_rad)};
}

/// Probability that the echo is strong enough: a surface that scatters a tenth comes back from
/// 80 m at right angles, and half of the echoes at that limit are lost.
double detection(double strength, double range_m) {
  constexpr double kLimit = 0.1 / (80.0 * 80.0);
  constexpr double kSharpness = 4.0;
  const double ratio = strength / (range_m * range_m) / kLimit;
  return 1.0 - 1.0 / (1.0 + std::pow(ratio, kSharpness));
}

/// What comes back along a beam; nothing for drop-outs.
std::optional<LidarPoint> echo(const LidarSpec& spec, const Hit& hit, const Eigen::Vector3d& beam,
                               const Eigen::Vector3d& beam_world, world::Random random) {
  const double cosine = std::clamp(-hit.normal.dot(beam_world), 0.0, 1.0);
  const double footprint_m =
      hit.distance_m * spec.beam_divergence_rad / std::sqrt(std::max(cosine, 0.05));
  const world::Appearance look =
      world::appearance(*hit.surface, hit.instance, hit.uv_m, static_cast<float>(footprint_m));
  const auto gloss = static_cast<double>(look.gloss);
  // Retro-reflectors turn even slanting light back, up to some 60 degrees.
  const double thrown_back =
      static_cast<double>(look.retro) * std::clamp(2.0 * cosine - 0.2, 0.0, 1.0);
  // What is mirrored is gone, but for a glint at right angles.
  constexpr double kGlint = 0.9986;  // cosine of 3 degrees
  const double scattered = static_cast<double>(look.nir) * cosine * (1.0 - gloss) +
                           (cosine > kGlint ? 0.5 * gloss : 0.0);
  constexpr double kRetroGain = 20.0;
  if (!random.chance(detection(scattered + kRetroGain * thrown_back, hit.distance_m))) {
    return std::nullopt;
  }
  // Strong echoes and slanting ones are timed worse.
  const double stretch_m = 0.25 * spec.beam_divergence_rad * hit.distance_m *
                           std::sqrt(1.0 - cosine * cosine) / std::max(cosine, 0.1);
  const double noise_m = std::hypot(spec.range_noise_m, std::min(stretch_m, 0.05));
  const double range_m = hit.distance_m + noise_m * random.normal();
  // The calibration for distance leaves some percent.
  constexpr double kIntensityNoise = 0.03;
  const double intensity = (scattered + thrown_back) * (1.0 + kIntensityNoise * random.normal());
  LidarPoint point;
  point.p_lidar_m = (range_m * beam).cast<float>();
  point.intensity = static_cast<float>(std::clamp(intensity, 0.0, 1.0));
  point.moving = hit.moving;
  return point;
}

void check(const LidarSpec& spec) {
  constexpr double kSlowest_hz = 0.5;  // LidarPoint::after_ns would overflow
  if (spec.beams < 1 || spec.columns < 1 || !(spec.rate_hz >= kSlowest_hz) ||
      !(spec.highest_rad >= spec.lowest_rad) || !(spec.max_range_m > 0.0) ||
      !(spec.range_noise_m >= 0.0) || !(spec.beam_divergence_rad >= 0.0)) {
    throw std::invalid_argument("lidar: beams, turns, range or noise make no sense");
  }
}

}  // namespace

std::vector<LidarPoint> scan(const Raycaster& raycaster, const LidarSpec& spec,
                             const std::function<RigidTransform(double)>& T_world_lidar,
                             std::uint64_t key, int threads) {
  check(spec);
  const double column_s = 1.0 / (spec.rate_hz * spec.columns);
  std::vector<RigidTransform> poses;
  for (int c = 0; c < spec.columns; ++c) {  // here: the caller's function may not be thread-safe
    poses.push_back(T_world_lidar(c * column_s));
  }
  std::vector<std::vector<LidarPoint>> columns(static_cast<std::size_t>(spec.columns));
  const auto beams = static_cast<std::size_t>(spec.beams);
  parallel_rows(spec.columns, threads, [&](int c) {
    const auto column = static_cast<std::size_t>(c);
    const RigidTransform& T = poses[column];
    const double azimuth_rad = std::numbers::pi * (1.0 - 2.0 * c / spec.columns);
    std::vector<Eigen::Vector3d> directions(beams);
    std::vector<Ray> rays(beams);
    std::vector<std::optional<Hit>> hits(beams);
    for (std::size_t b = 0; b < beams; ++b) {
      const double share = beams > 1 ? static_cast<double>(b) / (spec.beams - 1) : 0.0;
      directions[b] = beam_direction(
          azimuth_rad, spec.lowest_rad + share * (spec.highest_rad - spec.lowest_rad));
      rays[b] = {T.p, T.R * directions[b], spec.max_range_m};
    }
    raycaster.cast(rays, hits);
    for (std::size_t b = 0; b < beams; ++b) {
      if (!hits[b]) {
        continue;
      }
      auto point = echo(spec, *hits[b], directions[b], rays[b].direction,
                        world::Random(world::key(key, {column, b})));
      if (point) {
        point->after_ns = static_cast<std::int32_t>(std::llround(c * column_s * 1e9));
        columns[column].push_back(*point);
      }
    }
  });
  std::vector<LidarPoint> points;
  for (const auto& column : columns) {
    points.insert(points.end(), column.begin(), column.end());
  }
  return points;
}

}  // namespace topoloc::rendering

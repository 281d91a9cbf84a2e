// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/row_tracer.hpp"

#include "topoloc/world/random.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::rendering {
namespace {

/// Whether two samples of a pixel may be shaded as one patch.
bool alike(const Hit& a, const Hit& b) {
  constexpr double kSameWay = 0.97;
  return a.surface == b.surface && a.object == b.object && a.normal.dot(b.normal) > kSameWay &&
         std::abs(a.distance_m - b.distance_m) < 0.5 * a.distance_m;
}

}  // namespace

void RowTracer::trace(int row, int first_column, int every, std::span<float> radiances) {
  const std::size_t n = exposing_.samples.size();
  for (std::size_t first = 0; first < radiances.size(); first += kBlock) {
    const std::size_t pixels = std::min<std::size_t>(kBlock, radiances.size() - first);
    for (std::size_t i = 0; i < pixels; ++i) {
      aim(row, first_column + every * static_cast<int>(first + i), i * n);
    }
    exposing_.raycaster->cast(std::span(rays_).first(pixels * n), hits_);
    cast_to_sun(pixels * n);
    for (std::size_t i = 0; i < pixels; ++i) {
      radiances[first + i] = radiance(i * n);
    }
  }
}

/// Rays of a pixel's samples.
void RowTracer::aim(int row, int column, std::size_t first_ray) {
  const std::size_t n = exposing_.samples.size();
  const double row_s =
      exposing_.readout_s * (static_cast<double>(row) / (exposing_.pinhole.height_px - 1) - 0.5);
  // Times differ from pixel to pixel, else moving edges would show `n` times.
  const std::uint64_t key =
      world::key(0x71DEU, {static_cast<std::uint64_t>(row), static_cast<std::uint64_t>(column)});
  const double shift = (world::Random(key).uniform() - 0.5) / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i) {
    const PixelSample& sample = exposing_.samples[i];
    const RigidTransform T =
        exposing_.path->at(row_s + exposing_.exposure_s * (sample.time + shift - 0.5));
    const Eigen::Vector3d ray = exposing_.lens->ray(column - 0.5 + sample.x, row - 0.5 + sample.y);
    Ray& to = rays_[first_ray + i];
    to.origin_m = T.p;
    if (std::isnan(ray.x())) {  // beyond the lens: black, see radiance()
      to.direction = Eigen::Vector3d::UnitZ();
      to.max_m = 0.0;
    } else {
      to.direction = (T.R * ray).normalized();
      to.max_m = std::numeric_limits<double>::infinity();
    }
  }
}

/// All samples of the block that face the sun, at once.
void RowTracer::cast_to_sun(std::size_t count) {
  std::size_t cast = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sunlit_[i] = 0;
    if (!hits_[i]) {
      continue;
    }
    if (const auto ray = exposing_.shading->to_sun(*hits_[i], i)) {
      sun_rays_[cast] = *ray;
      sun_of_[cast++] = i;
    }
  }
  exposing_.raycaster->blocked(std::span(sun_rays_).first(cast), sun_blocked_);
  for (std::size_t i = 0; i < cast; ++i) {
    sunlit_[sun_of_[i]] = sun_blocked_[i] == 0 ? 1 : 0;
  }
}

float RowTracer::radiance(std::size_t first_ray) {
  const std::size_t n = exposing_.samples.size();
  if (rays_[first_ray].max_m == 0.0) {
    return 0.0F;
  }
  float sum = 0.0F;
  Eigen::Vector3d sky_direction = Eigen::Vector3d::Zero();
  int sky_samples = 0;
  std::array<bool, kMostSamples> done{};
  for (std::size_t i = 0; i < n; ++i) {
    if (done[i]) {
      continue;
    }
    if (!hits_[first_ray + i]) {
      sky_direction += rays_[first_ray + i].direction;
      ++sky_samples;
      continue;
    }
    const Hit& first = *hits_[first_ray + i];
    std::size_t count = 0;
    float sunlit = 0.0F;
    for (std::size_t j = i; j < n; ++j) {
      const auto& other = hits_[first_ray + j];
      if (!done[j] && other && alike(first, *other)) {
        done[j] = true;
        sunlit += static_cast<float>(sunlit_[first_ray + j]);
        patch_hits_[count] = *other;
        patch_directions_[count++] = rays_[first_ray + j].direction;
      }
    }
    const auto share = static_cast<float>(count);
    sum += share * exposing_.shading->radiance({std::span(patch_hits_).first(count),
                                                std::span(patch_directions_).first(count),
                                                sunlit / share, 1.0 / exposing_.pinhole.fx_px});
  }
  if (sky_samples > 0) {
    sum += static_cast<float>(sky_samples) *
           exposing_.shading->sky().radiance(sky_direction.normalized());
  }
  return sum / static_cast<float>(n);
}

}  // namespace topoloc::rendering

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/sky.hpp"

#include "topoloc/world/random.hpp"

#include "rendering/hemisphere.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace topoloc::rendering {
namespace {

Eigen::Vector3d towards(double azimuth_deg, double elevation_deg) {
  const double azimuth = azimuth_deg * std::numbers::pi / 180.0;
  const double elevation = elevation_deg * std::numbers::pi / 180.0;
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

std::uint32_t hash(std::uint32_t x, std::uint32_t y, std::uint32_t seed) {
  std::uint32_t h = x * 0x8DA6B343U ^ y * 0xD8163841U ^ seed;
  h = (h ^ (h >> 15U)) * 0x2C1B3C6DU;
  h = (h ^ (h >> 12U)) * 0x297A2D39U;
  return h ^ (h >> 15U);
}

/// Smooth noise, 0 to 1.
float value_noise(float x, float y, std::uint32_t seed) {
  const float fx = std::floor(x);
  const float fy = std::floor(y);
  const auto ix = static_cast<std::uint32_t>(static_cast<std::int32_t>(fx));
  const auto iy = static_cast<std::uint32_t>(static_cast<std::int32_t>(fy));
  const auto at = [&](std::uint32_t dx, std::uint32_t dy) {
    return static_cast<float>(hash(ix + dx, iy + dy, seed) >> 8U) * 0x1p-24F;
  };
  const auto smooth = [](float t) { return t * t * (3.0F - 2.0F * t); };
  const float u = smooth(x - fx);
  const float v = smooth(y - fy);
  const float below = at(0, 0) + u * (at(1, 0) - at(0, 0));
  const float above = at(0, 1) + u * (at(1, 1) - at(0, 1));
  return below + v * (above - below);
}

/// How much cloud there is in a direction, 0 to 1, on a plane above; fades towards the horizon.
float cloud(const Eigen::Vector3d& direction, double cover, std::uint32_t seed) {
  const double height = std::max(direction.z(), 0.0) + 0.08;
  auto x = static_cast<float>(direction.x() / height * 1.3);
  auto y = static_cast<float>(direction.y() / height * 1.3);
  constexpr int kOctaves = 5;
  float sum = 0.0F;
  float weight = 0.5F;
  for (int octave = 0; octave < kOctaves; ++octave) {
    sum += weight * value_noise(x, y, seed + static_cast<std::uint32_t>(octave));
    weight *= 0.5F;
    x *= 2.03F;
    y *= 2.03F;
  }
  const auto threshold = static_cast<float>(0.75 - 0.5 * cover);
  const float t = std::clamp((sum - threshold) / 0.25F, 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

}  // namespace

Illumination illumination(Light light, std::uint64_t seed) {
  Illumination result;
  world::Random random(world::key(seed, {0x5E4}));
  const double azimuth_deg = random.uniform(-180.0, 180.0);
  const double elevation_deg = random.uniform(22.0, 60.0);
  const double cover = random.uniform(0.15, 0.75);
  switch (light) {
    case Light::kDay:
      result = {towards(azimuth_deg, elevation_deg), 0.85, 0.12, 0.32, 0.0, 0.55, cover, false};
      break;
    case Light::kOvercast:
      result = {Eigen::Vector3d::UnitZ(), 0.0, 0.26, 0.11, 0.0, 0.3, 0.5, false};
      break;
    case Light::kDusk:  // the sun has just set
      result = {towards(azimuth_deg, -4.0), 0.0, 0.0014, 0.0022, 0.02, 0.003, cover, true};
      break;
    case Light::kNight:  // a town's glow
      result = {Eigen::Vector3d::UnitZ(), 0.0, 2e-6, 6e-6, 0.0, 6e-6, cover, true};
      break;
  }
  return result;
}

std::string_view name(Light light) {
  switch (light) {
    case Light::kDay:
      return "day";
    case Light::kOvercast:
      return "overcast";
    case Light::kDusk:
      return "dusk";
    case Light::kNight:
      return "night";
  }
  return "";
}

Light light_of(std::string_view name_) {
  std::string names;
  for (const Light light : {Light::kDay, Light::kOvercast, Light::kDusk, Light::kNight}) {
    if (name(light) == name_) {
      return light;
    }
    names += (names.empty() ? "" : ", ") + std::string(name(light));
  }
  throw std::invalid_argument("no light \"" + std::string(name_) + "\": expected " + names);
}

Sky::Sky(const Illumination& light, std::uint64_t seed)
    : light_(light), seed_(static_cast<std::uint32_t>(seed ^ (seed >> 32U))) {
  double sum = 0.0;
  for (const Eigen::Vector3d& direction : hemisphere()) {
    sum += static_cast<double>(mean_radiance(direction));
  }
  irradiance_ = static_cast<float>(sum / static_cast<double>(hemisphere().size()));
}

float Sky::mean_radiance(const Eigen::Vector3d& direction) const {
  const double z = std::clamp(direction.z(), 0.0, 1.0);
  double result = 0.0;
  if (light_.horizon < light_.zenith) {  // overcast, after the CIE: three times as bright above
    result = light_.horizon + (light_.zenith - light_.horizon) * z;
  } else {
    result = light_.zenith + (light_.horizon - light_.zenith) * std::exp(-4.0 * z);
  }
  if (light_.glow > 0.0) {
    const double side = direction.head<2>().normalized().dot(light_.to_sun.head<2>().normalized());
    const double near = std::max(0.0, 0.5 + 0.5 * side);
    result += light_.glow * near * near * near * std::exp(-6.0 * z);
  }
  return static_cast<float>(result);
}

float Sky::radiance(const Eigen::Vector3d& direction) const {
  float result = mean_radiance(direction);
  if (light_.cloud_cover > 0.0) {
    const float share = cloud(direction, light_.cloud_cover, seed_) *
                        static_cast<float>(std::clamp(direction.z() / 0.15, 0.0, 1.0));
    result += 0.8F * share * (static_cast<float>(light_.clouds) - result);
  }
  if (light_.sun > 0.0) {  // its disc and the glow around it
    const double from_sun = 1.0 - direction.dot(light_.to_sun);
    constexpr double kDisc = 1.1e-5;
    result += static_cast<float>(0.5 * std::exp(-from_sun / 0.01) + (from_sun < kDisc ? 5e3 : 0.0));
  }
  return result;
}

}  // namespace topoloc::rendering

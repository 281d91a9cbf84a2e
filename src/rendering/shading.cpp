// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/shading.hpp"

#include "rendering/hemisphere.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace topoloc::rendering {
namespace {

bool translucent(const Hit& hit) { return hit.surface->material == world::Material::kFoliage; }

/// Share of the sun's light on a surface: a leaf passes on some of what falls on its back.
double sun_cosine(const Hit& hit, const Eigen::Vector3d& to_sun) {
  const double cosine = hit.normal.dot(to_sun);
  return translucent(hit) && cosine < 0.0 ? -0.5 * cosine : std::max(cosine, 0.0);
}

/// Mean appearance of the samples. Where they lie close together, the pattern itself is averaged
/// over the pixel and looked up once; where they are strung out, on a road far ahead or by motion,
/// each stands for its part of the string.
world::Appearance appearance_of(const Patch& patch) {
  const Hit& hit = patch.hit;
  const auto n = static_cast<float>(patch.uvs_m.size());
  const auto across_m = static_cast<float>(hit.distance_m * patch.pixel_rad);
  if (patch.uvs_m.size() == 1) {
    const double cosine = std::abs(hit.normal.dot(patch.direction));
    const float stretch = static_cast<float>(1.0 / std::sqrt(std::max(cosine, 0.04)));
    return world::appearance(*hit.surface, hit.instance, patch.uvs_m.front(), across_m * stretch);
  }
  Eigen::Vector2f least = patch.uvs_m.front();
  Eigen::Vector2f most = patch.uvs_m.front();
  Eigen::Vector2f mean = Eigen::Vector2f::Zero();
  for (const Eigen::Vector2f& uv_m : patch.uvs_m) {
    least = least.cwiseMin(uv_m);
    most = most.cwiseMax(uv_m);
    mean += uv_m / n;
  }
  const float spread_m = (most - least).norm();
  constexpr float kTogether = 1.6F;
  if (spread_m < kTogether * across_m) {
    return world::appearance(*hit.surface, hit.instance, mean, std::max(across_m, spread_m));
  }
  const float footprint_m = std::max(across_m, 1.2F * spread_m / n);
  world::Appearance sum{0.0F, 0.0F, 0.0F, 0.0F, 0.0F};
  for (const Eigen::Vector2f& uv_m : patch.uvs_m) {
    const world::Appearance look = world::appearance(*hit.surface, hit.instance, uv_m, footprint_m);
    sum.albedo += look.albedo / n;
    sum.retro += look.retro / n;
    sum.emission += look.emission / n;
    sum.gloss += look.gloss / n;
    sum.always_on |= look.always_on;
  }
  return sum;
}

}  // namespace

Shading::Shading(const Raycaster& raycaster, Light light, std::uint64_t seed)
    : raycaster_(&raycaster),
      light_(illumination(light, seed)),
      sun_frame_(frame_of(light_.to_sun)),
      sky_(light_, seed),
      lamps_(raycaster, light_.lamps_lit),
      ambient_(raycaster, light_, sky_) {}

void Shading::begin_frame(const std::optional<HeadLamps>& head_lamps) {
  head_lamps_ = head_lamps;
  ambient_.make_room();
}

std::optional<Ray> Shading::to_sun(const Hit& hit, std::size_t sample) const {
  if (light_.sun <= 0.0 || sun_cosine(hit, light_.to_sun) <= 0.0) {
    return std::nullopt;
  }
  constexpr double kRadius = 0.00465;
  constexpr std::array<std::array<double, 2>, 4> kDisc{
      {{-0.6, -0.3}, {0.3, -0.6}, {-0.3, 0.6}, {0.6, 0.3}}};
  const auto& place = kDisc[sample % kDisc.size()];
  const Eigen::Vector3d towards =
      light_.to_sun + kRadius * (place[0] * sun_frame_.col(0) + place[1] * sun_frame_.col(1));
  Hit from = hit;
  if (from.normal.dot(light_.to_sun) < 0.0) {  // through a leaf
    from.normal = -from.normal;
  }
  return Ray{off_surface(from), towards.normalized()};
}

/// Share of the sky's light that moving vehicles leave: what stands still is in Ambient.
float Shading::beside_moving(const Hit& hit) const {
  constexpr double kNear_m = 12.0;  // from its rear axle: a bus is long
  constexpr double kReach_m = 3.0;
  constexpr std::size_t kEvery = 2;
  if (hit.moving || !raycaster_->near_moving(hit.point_m, kNear_m)) {
    return 1.0F;
  }
  const Eigen::Matrix3d R = frame_of(hit.normal);
  const Eigen::Vector3d from_m = off_surface(hit);
  std::array<Ray, kHemisphereRays / kEvery> rays;
  std::array<std::uint8_t, kHemisphereRays / kEvery> blocked{};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    rays[i] = {from_m, R * hemisphere()[i * kEvery], kReach_m};
  }
  raycaster_->blocked(rays, blocked, Obstacles::kMoving);
  const auto free = std::count(blocked.begin(), blocked.end(), std::uint8_t{0});
  return static_cast<float>(free) / static_cast<float>(rays.size());
}

/// Radiance of what a smooth surface mirrors. What is seen in it gets the light of the surface
/// itself: good enough for a blurred reflection.
float Shading::mirrored(const Hit& hit, const Eigen::Vector3d& direction, float ambient) const {
  const Eigen::Vector3d reflection = direction - 2.0 * direction.dot(hit.normal) * hit.normal;
  const auto seen = raycaster_->cast({off_surface(hit), reflection});
  if (!seen) {
    constexpr float kMost = 4.0F;  // the sun's disc would flicker
    return std::min(sky_.radiance(reflection), kMost);
  }
  constexpr float kBlur_m = 0.1F;
  const world::Appearance look =
      world::appearance(*seen->surface, seen->instance, seen->uv_m, kBlur_m);
  float irradiance = ambient;
  const auto sun = to_sun(*seen, 0);
  if (sun && !raycaster_->blocked(*sun)) {
    irradiance += static_cast<float>(light_.sun * sun_cosine(*seen, light_.to_sun));
  }
  return look.albedo * irradiance;
}

float Shading::around(const Patch& patch) {
  const Hit& hit = patch.hit;
  const double cosine = std::abs(hit.normal.dot(patch.direction));
  const double footprint_m = hit.distance_m * patch.pixel_rad / std::max(cosine, 0.02);
  return beside_moving(hit) * ambient_.at(hit, footprint_m);
}

void Shading::light_up(std::span<Patch> patches) {
  lamps_.shine(patches);
  if (head_lamps_) {
    head_lamps_->shine(*raycaster_, patches);
  }
}

float Shading::radiance(const Patch& patch) const {
  const Hit& hit = patch.hit;
  const Eigen::Vector3d& direction = patch.direction;
  const world::Appearance look = appearance_of(patch);
  const float ambient = patch.around;

  float irradiance = ambient + patch.lamps + patch.head_lamps;
  if (patch.sunlit > 0.0F) {
    irradiance += patch.sunlit * static_cast<float>(light_.sun * sun_cosine(hit, light_.to_sun));
  }
  float thrown_back = 0.0F;
  if (look.retro > 0.0F && patch.beam > 0.0F) {
    thrown_back =
        look.retro * patch.beam * retro_gain(head_lamps_->observation_rad(hit, direction));
  }
  float result = look.albedo * irradiance + thrown_back;
  constexpr float kDull = 0.02F;
  if (look.gloss > kDull) {
    // After Schlick: everything mirrors at grazing incidence.
    const auto cosine = static_cast<float>(std::abs(hit.normal.dot(direction)));
    const float grazing = 1.0F - cosine;
    const float share =
        look.gloss + (1.0F - look.gloss) * 0.6F * grazing * grazing * grazing * grazing * grazing;
    // What is hardly smooth mirrors everything around at once, and that stands in the same light.
    const float lit_around = ambient + kBounceAlbedo * (patch.lamps + patch.head_lamps);
    const float seen =
        look.gloss < world::kMirrorGloss ? lit_around : mirrored(hit, direction, lit_around);
    result = (1.0F - share) * result + share * seen;
  }
  return result + (light_.lamps_lit || look.always_on ? look.emission : 0.0F);
}

}  // namespace topoloc::rendering

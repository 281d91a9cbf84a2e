// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/lamps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace topoloc::rendering {
namespace {

constexpr double kLampCell_m = 10.0;
constexpr double kLampReach_m = 45.0;
constexpr std::size_t kMostOfCell = 10;
constexpr std::size_t kMostShadows = 3;

std::uint64_t cell_key(std::int64_t x, std::int64_t y) {
  return static_cast<std::uint64_t>(x) << 32U ^ (static_cast<std::uint64_t>(y) & 0xFFFFFFFFU);
}

std::int64_t cell_of(double x_m) {
  return static_cast<std::int64_t>(std::floor(x_m / kLampCell_m));
}

double smooth_step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// 1 beside a lamp, 0 where it reaches to: nothing switches on with distance.
double fading(double squared_distance_m2) {
  const double left = 1.0 - squared_distance_m2 / (kLampReach_m * kLampReach_m);
  return left > 0.0 ? left * left : 0.0;
}

/// Irradiance by what the surroundings of the lit spot throw about, some metres from the lamp: to
/// all sides, above the lamp too. It is not followed further.
double scattered(const world::Lamp& lamp, double squared_distance_m2) {
  constexpr double kSurroundings_m = 5.0;
  constexpr double kShare = 0.2;
  return kShare * lamp.intensity * fading(squared_distance_m2) /
         (squared_distance_m2 + kSurroundings_m * kSurroundings_m);
}

/// Irradiance at right angles to the light, at a place `to_point` from the lamp.
double strength(const world::Lamp& lamp, const Eigen::Vector3d& to_point) {
  constexpr double kLeast_m = 0.3;  // a lamp is no point
  const double d2 = std::max(to_point.squaredNorm(), kLeast_m * kLeast_m);
  const double cosine = lamp.direction.dot(to_point) / std::sqrt(d2);
  const double cone =
      lamp.cos_cone <= -1.0
          ? 1.0
          : smooth_step(lamp.cos_cone, lamp.cos_cone + 0.3 * (1.0 - lamp.cos_cone), cosine);
  return lamp.intensity * cone * fading(d2) / d2;
}

}  // namespace

Lamps::Lamps(const Raycaster& raycaster, bool lit) : raycaster_(&raycaster) {
  const auto& lamps = raycaster.world().lamps;
  for (std::uint32_t i = 0; i < lamps.size(); ++i) {
    if (!lit && !lamps[i].always_on) {
      continue;
    }
    const Eigen::Vector3d& p = lamps[i].position_m;
    for (std::int64_t x = cell_of(p.x() - kLampReach_m); x <= cell_of(p.x() + kLampReach_m); ++x) {
      for (std::int64_t y = cell_of(p.y() - kLampReach_m); y <= cell_of(p.y() + kLampReach_m);
           ++y) {
        cells_[cell_key(x, y)].push_back(i);
      }
    }
  }
  for (auto& [key, cell] : cells_) {
    if (cell.size() <= kMostOfCell) {
      continue;
    }
    const Eigen::Vector2d middle(
        (static_cast<double>(static_cast<std::int32_t>(key >> 32U)) + 0.5) * kLampCell_m,
        (static_cast<double>(static_cast<std::int32_t>(key)) + 0.5) * kLampCell_m);
    const auto weight = [&](std::uint32_t i) {
      return lamps[i].intensity / (25.0 + (lamps[i].position_m.head<2>() - middle).squaredNorm());
    };
    std::stable_sort(cell.begin(), cell.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return weight(a) > weight(b); });
    cell.resize(kMostOfCell);
  }
}

std::span<const std::uint32_t> Lamps::near(const Eigen::Vector3d& point_m) const {
  const auto found = cells_.find(cell_key(cell_of(point_m.x()), cell_of(point_m.y())));
  return found == cells_.end() ? std::span<const std::uint32_t>() : found->second;
}

/// Light that may not reach its patch.
struct Lamps::Shadow {
  Ray ray;
  std::size_t rank = 0;  ///< among the patch's lights
  Patch* patch = nullptr;
  float irradiance = 0.0F;
};

void Lamps::shine(std::span<Patch> patches) const {
  if (cells_.empty()) {
    return;
  }
  std::vector<Shadow> shadows;
  for (Patch& patch : patches) {
    shine(patch, shadows);
  }
  // The strongest lamp is the same one for most neighbours: their rays run side by side.
  std::stable_sort(shadows.begin(), shadows.end(),
                   [](const Shadow& a, const Shadow& b) { return a.rank < b.rank; });
  std::vector<Ray> rays;
  for (const Shadow& shadow : shadows) {
    rays.push_back(shadow.ray);
  }
  std::vector<std::uint8_t> blocked(rays.size());
  raycaster_->blocked(rays, blocked);
  for (std::size_t i = 0; i < shadows.size(); ++i) {
    shadows[i].patch->lamps += blocked[i] != 0 ? 0.0F : shadows[i].irradiance;
  }
}

void Lamps::shine(Patch& patch, std::vector<Shadow>& shadows) const {
  struct Lit {
    double irradiance = 0.0;
    std::uint32_t lamp = 0;
  };
  const Hit& hit = patch.hit;
  std::array<Lit, kMostOfCell> lights;
  std::size_t count = 0;
  double sum = 0.0;
  const auto& lamps = raycaster_->world().lamps;
  for (const std::uint32_t i : near(hit.point_m)) {
    const Eigen::Vector3d to_point = hit.point_m - lamps[i].position_m;
    sum += scattered(lamps[i], to_point.squaredNorm());
    const double at_right_angles = strength(lamps[i], to_point);
    const double cosine = -hit.normal.dot(to_point) / std::max(to_point.norm(), 1e-6);
    if (at_right_angles > 0.0 && cosine > 0.0) {
      lights[count++] = {at_right_angles * cosine, i};
    }
  }
  const auto begin = lights.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  std::sort(begin, end, [](const Lit& a, const Lit& b) {
    return a.irradiance != b.irradiance ? a.irradiance > b.irradiance : a.lamp < b.lamp;
  });
  const Eigen::Vector3d from_m = off_surface(hit);
  constexpr double kNegligible = 0.05;
  std::size_t traced = 0;
  while (traced < std::min(count, kMostShadows) &&
         lights[traced].irradiance > kNegligible * lights[0].irradiance) {
    ++traced;
  }
  // The weaker ones fare as the strongest do: behind a wall it is dark.
  double rest = 0.0;
  for (std::size_t i = traced; i < count; ++i) {
    rest += lights[i].irradiance / static_cast<double>(traced);
  }
  for (std::size_t i = 0; i < traced; ++i) {
    const Eigen::Vector3d to_lamp = lamps[lights[i].lamp].position_m - from_m;
    const double distance_m = to_lamp.norm();
    constexpr double kCasing_m = 0.35;  // a lamp does not stand in its own light
    shadows.push_back({{from_m, to_lamp / distance_m, distance_m - kCasing_m},
                       i,
                       &patch,
                       static_cast<float>(lights[i].irradiance + rest)});
  }
  patch.lamps = static_cast<float>(sum);
}

}  // namespace topoloc::rendering

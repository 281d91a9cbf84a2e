// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/bump.hpp"

#include "topoloc/world/random.hpp"

#include "world/profile.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace topoloc::world {
namespace {

constexpr double kSpeedBump_m = 0.06;

double fraction(std::uint64_t bits) { return static_cast<double>(bits >> 11U) * 0x1p-53; }

// Quintic, so that a wheel feels no jump of the slope's change either.
double eased(double t) { return t * t * t * (10.0 + t * (6.0 * t - 15.0)); }

// Smooth noise in [-0.5, 0.5]; twice differentiable.
double waves(double x, double y, std::uint64_t seed) {
  const double ix = std::floor(x);
  const double iy = std::floor(y);
  const double fx = eased(x - ix);
  const double fy = eased(y - iy);
  const auto corner = [&](int dx, int dy) {
    return fraction(key(seed, {static_cast<std::uint64_t>(static_cast<std::int64_t>(ix) + dx),
                               static_cast<std::uint64_t>(static_cast<std::int64_t>(iy) + dy)}));
  };
  return std::lerp(std::lerp(corner(0, 0), corner(1, 0), fx),
                   std::lerp(corner(0, 1), corner(1, 1), fx), fy) -
         0.5;
}

struct Octave {
  double along_m;
  double across_m;
  double height_m;  // peak to peak
};

// About ISO 8608 class A to B: amplitude grows with the wavelength, left and right differ where
// waves are short.
constexpr Octave kOctaves[] = {
    {35.0, 30.0, 0.030}, {11.0, 8.0, 0.013}, {3.7, 2.5, 0.0055}, {1.3, 1.1, 0.0022}};

// A trough here and there, where a pipe was laid or a wheel has dug.
double dips(std::uint64_t seed, double along_m, double left_m) {
  constexpr double kPiece_m = 18.0;
  const auto piece = static_cast<std::int64_t>(std::floor(along_m / kPiece_m));
  Random random(key(seed, {0xD1B5, static_cast<std::uint64_t>(piece)}));
  if (!random.chance(0.35)) {
    return 0.0;
  }
  const double radius_m = random.uniform(0.7, 2.2);
  const double middle_m =
      kPiece_m * static_cast<double>(piece) + random.uniform(radius_m, kPiece_m - radius_m);
  const double across_m = random.uniform(-9.0, 9.0);
  const double depth_m = random.uniform(0.004, 0.018);
  const double distance = std::hypot((along_m - middle_m) / radius_m, (left_m - across_m) / 1.4);
  return distance < 1.0 ? -depth_m * (1.0 - eased(distance)) : 0.0;
}

}  // namespace

std::optional<double> speed_bump_in(std::uint64_t seed, const Route& route,
                                    const std::vector<Section>& sections, std::int64_t piece) {
  constexpr double kClear_m = 25.0;
  Random random(key(seed, {0x5B39, static_cast<std::uint64_t>(piece)}));
  if (!random.chance(0.6)) {
    return std::nullopt;
  }
  const double middle_m =
      kSpeedBumpPiece_m * (static_cast<double>(piece) + random.uniform(0.15, 0.85));
  if (middle_m < kClear_m || middle_m > route.length_m() - kClear_m) {
    return std::nullopt;
  }
  const Section& section = section_at(sections, middle_m);
  if (section.setting != Setting::kTown || middle_m > section.end_m - 70.0 ||
      middle_m < section.begin_m + kClear_m || std::abs(route.curvature_1pm(middle_m)) > 0.004) {
    return std::nullopt;
  }
  return middle_m;
}

double bump_at(std::uint64_t seed, const Route& route, const std::vector<Section>& sections,
               double along_m, double left_m) {
  double height_m = 0.0;
  std::uint64_t index = 0;
  for (const Octave& octave : kOctaves) {
    height_m += octave.height_m * waves(along_m / octave.along_m, left_m / octave.across_m,
                                        key(seed, {0xB0B, ++index}));
  }
  height_m += dips(seed, along_m, left_m);
  const auto piece = static_cast<std::int64_t>(std::floor(along_m / kSpeedBumpPiece_m));
  if (const auto middle_m = speed_bump_in(seed, route, sections, piece)) {
    const double share = 1.0 - std::abs(along_m - *middle_m) / kSpeedBumpHalf_m;
    if (share > 0.0) {
      height_m += kSpeedBump_m * eased(std::min(1.0, 1.6 * share));
    }
  }
  return height_m;
}

double mesh_bump(const World& world, double along_m, double left_m) {
  const double station = std::floor(along_m / kStation_m);
  const double share = along_m / kStation_m - station;
  const double before = world.bump_m(station * kStation_m, left_m);
  if (share < 1e-9) {
    return before;
  }
  return std::lerp(before, world.bump_m((station + 1.0) * kStation_m, left_m), share);
}

}  // namespace topoloc::world

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/verge.hpp"

#include "world/noise.hpp"
#include "world/steps.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::world {
namespace {

constexpr double kTownFootway_m = 1.2;  // less than this: not a town's

double ease(double x, double from, double to) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

void make_side(Maker& maker, double begin_m, double end_m, bool right) {
  MeshBuilder builder = maker.unique();
  const double sign = right ? -1.0 : 1.0;
  constexpr double kPiece_m = 160.0;
  for (const double s : steps(begin_m, end_m, kPiece_m)) {
    const std::uint32_t grass = builder.surface(
        Material::kGrass,
        static_cast<std::uint32_t>(maker.draw(0x6A55, static_cast<std::uint64_t>(s + 1e4))),
        {0.0F, 0.0F});
    const std::uint32_t gravel = builder.surface(
        Material::kGround,
        static_cast<std::uint32_t>(maker.draw(0x6A56, static_cast<std::uint64_t>(s + 1e4))),
        {0.0F, 0.24F});
    const std::vector<double> along = stations(s, std::min(s + kPiece_m, end_m), 2.0);
    const auto strip = [&](const std::vector<double>& outs, std::uint32_t surface) {
      ribbon(
          builder, maker.route(), along,
          [&](double at) {
            const double edge = maker.profile(at).edge(right);
            std::vector<Across> points;
            for (const double out : outs) {
              points.push_back({sign * (edge + out), verge_m(maker, at, right, out)});
            }
            points.front().up_m -= outs.front() > 0.0 ? 0.0 : 0.01;
            if (outs.back() >= kVerge_m) {
              points.push_back({sign * (edge + outs.back() + 0.5), points.back().up_m - 6.0});
            }
            return points;
          },
          surface);
    };
    strip({0.0, 0.4, 0.8}, gravel);
    strip({0.8, 1.7, 2.6, 3.4, 4.4, 6.0, 8.5, 12.0, 17.0, 23.0, 30.0, kVerge_m}, grass);
  }
}

void make_median(Maker& maker, double begin_m, double end_m) {
  MeshBuilder builder = maker.unique();
  const std::uint32_t grass = builder.surface(
      Material::kGrass, static_cast<std::uint32_t>(maker.draw(0x3ED1)), {0.0F, 0.3F});
  ribbon(
      builder, maker.route(), stations(begin_m, end_m, 1.0),
      [&](double s) -> std::vector<Across> {
        const double half = maker.profile(s).median_half_m;
        const double up = std::min(0.08, 0.1 * half);
        return {{-half, -0.015}, {-0.8 * half, up}, {0.8 * half, up}, {half, -0.015}};
      },
      grass);
}

void plant_side(Maker& maker, double begin_m, double end_m, bool right) {
  const double sign = right ? -1.0 : 1.0;
  Random random(
      maker.draw(0x91A4, static_cast<std::uint64_t>(begin_m + 1e4) * 2 + (right ? 1 : 0)));
  const auto place = [&](double s, double out, double sink) {
    const double edge = maker.profile(s).edge(right);
    return maker.world.route.point(s, sign * (edge + out), verge_m(maker, s, right, out) - sink);
  };
  for (const double s : steps(begin_m, end_m, 0.8)) {
    // Herbs in drifts, dense where it is not mown.
    const double drift = noise::value(static_cast<float>(s / 17.0), right ? 1.5F : 4.5F,
                                      static_cast<std::uint32_t>(maker.world.spec.seed));
    if (random.chance(0.25 + 0.9 * drift * drift)) {
      const double out = 1.0 + 7.0 * std::pow(random.uniform(), 1.6);
      maker.put_any(maker.prototypes.tufts, place(s, out, 0.02), random, 0.6, 1.5);
    }
    const double thicket = noise::value(static_cast<float>(s / 45.0), right ? 7.5F : 9.5F,
                                        static_cast<std::uint32_t>(maker.world.spec.seed) + 1U);
    if (thicket > 0.5 && random.chance(0.28)) {
      const double out = random.uniform(7.0, 20.0);
      maker.put_any(maker.prototypes.bushes, place(s, out, 0.1), random, 0.8, 1.8);
    }
    if (random.chance(thicket > 0.55 ? 0.16 : 0.018)) {
      const double out = random.uniform(10.0, 36.0);
      maker.put_any(maker.prototypes.trees, place(s, out, 0.2), random, 0.6, 1.15);
    }
  }
}

void plant_median(Maker& maker, double begin_m, double end_m) {
  Random random(maker.draw(0x3ED2, static_cast<std::uint64_t>(begin_m + 1e4)));
  for (const double s : steps(begin_m, end_m, 1.1)) {
    const double half = maker.profile(s).median_half_m;
    if (half > 1.2 && random.chance(0.45)) {
      const double scale = random.uniform(0.5, 1.2);
      const std::uint64_t seed = random.next();
      const double heading = random.uniform(0.0, 6.28);
      const Point at = maker.world.route.point(s, random.uniform(-0.6, 0.6) * half, 0.05);
      const auto& tufts = maker.prototypes.tufts;
      maker.put(tufts[static_cast<std::size_t>(random.below(4))], upright_at(at, heading), seed,
                scale);
    }
  }
}

}  // namespace

bool open_country(const Maker& maker, double along_m) {
  return maker.profile(along_m).footway_m < kTownFootway_m;
}

double verge_m(const Maker& maker, double along_m, bool right, double out_m) {
  const auto seed = static_cast<std::uint32_t>(maker.world.spec.seed) + (right ? 301U : 302U);
  const auto slow = [&](double period_m, std::uint32_t salt) {
    return static_cast<double>(
        noise::value(static_cast<float>(along_m / period_m), 0.5F, seed + salt));
  };
  // Shoulder, ditch, then a cutting or an embankment.
  const double ditch = -0.45 * (ease(out_m, 1.4, 2.8) - ease(out_m, 3.8, 6.0));
  const double bank = (6.5 * slow(85.0, 0) - 2.6) * ease(out_m, 6.0, 19.0) +
                      4.0 * (slow(60.0, 1) - 0.4) * ease(out_m, 19.0, kVerge_m);
  const double rough =
      0.12 *
      (noise::value(static_cast<float>(along_m / 3.0), static_cast<float>(out_m / 3.0), seed + 2U) -
       0.5) *
      ease(out_m, 1.5, 5.0);
  return -0.03 * ease(out_m, 0.0, 0.8) + ditch + bank + rough;
}

void make_verge(Maker& maker, double begin_m, double end_m) {
  for (const bool right : {true, false}) {
    make_side(maker, begin_m, end_m, right);
    plant_side(maker, begin_m, end_m, right);
  }
  double from_m = begin_m;
  while (from_m < end_m && maker.profile(from_m).median_half_m < 0.25) {
    from_m += 1.0;
  }
  if (from_m < end_m - 2.0) {
    make_median(maker, from_m, end_m);
    plant_median(maker, from_m, end_m);
  }
}

}  // namespace topoloc::world

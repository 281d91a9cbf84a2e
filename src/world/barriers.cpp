// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/steps.hpp"
#include "world/verge.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::world {
namespace {

constexpr double kPost_m = 2.0;        // between posts of a rail
constexpr double kRailOut_m = 0.75;    // of a rail from the road's edge
constexpr double kBarrierOut_m = 2.3;  // of a noise barrier
constexpr double kBay_m = 4.0;         // between its posts

// W-shaped beam; `side` tells where the traffic is.
void add_rail(Maker& maker, double begin_m, double end_m,
              const std::function<double(double)>& left_m, double side, std::uint64_t seed) {
  MeshBuilder builder = maker.unique();
  const std::uint32_t steel =
      builder.surface(Material::kGuardRail, static_cast<std::uint32_t>(seed));
  const std::uint32_t post =
      builder.surface(Material::kGuardRail, static_cast<std::uint32_t>(seed) + 1U);
  ribbon(
      builder, maker.route(), stations(begin_m, end_m, 1.0),
      [&](double s) -> std::vector<Across> {
        const double left = left_m(s);
        std::vector<Across> result;
        // Heights and depths of the two waves.
        constexpr double kWave[][2] = {{0.0, 0.46}, {0.075, 0.50}, {0.075, 0.56}, {0.0, 0.60},
                                       {0.0, 0.63}, {0.075, 0.67}, {0.075, 0.73}, {0.0, 0.77}};
        for (const auto& [out, up] : kWave) {
          result.push_back({left + side * out, up});
        }
        return result;
      },
      steel);
  for (const double s : steps(std::ceil(begin_m / kPost_m) * kPost_m, end_m, kPost_m)) {
    builder.set_frame(maker.upright(s, left_m(s)));
    builder.box(Point(-0.05, -0.03 - side * 0.06, -0.4), Point(0.05, 0.03 - side * 0.06, 0.74),
                post);
  }
  builder.set_frame({});
}

void add_noise_barrier(Maker& maker, double begin_m, double end_m, bool right, Random& random) {
  MeshBuilder builder = maker.unique();
  const double sign = right ? -1.0 : 1.0;
  const double height_m = random.uniform(2.6, 4.5);
  const bool wooden = random.chance(0.4);
  const auto tone = static_cast<float>(random.uniform(0.22, 0.45));
  const std::uint32_t posts = builder.surface(Material::kConcrete, random, {2.0F, 0.4F});
  for (const double s : steps(begin_m, end_m - kBay_m + 1e-9, kBay_m)) {
    const auto at = [&](double along) {
      const double out = kBarrierOut_m;
      return maker.world.route.point(along, sign * (maker.profile(along).edge(right) + out),
                                     verge_m(maker, along, right, out) - 0.3);
    };
    // A bay has its own weather, here and there its own colour or somebody's paint.
    const float here = random.chance(0.12) ? tone * 1.3F : tone;
    const std::uint32_t panel =
        wooden ? builder.surface(Material::kFence, random, {1.0F, here})
               : builder.surface(Material::kFacade, random,
                                 {random.chance(0.7) ? 2.0F : 3.0F, here, 4.0F});
    const Point a = at(s);
    const Point b = at(s + kBay_m);
    builder.set_frame({});
    const double steps = 0.25 * std::round(4.0 * random.uniform(-0.05, 0.3));
    builder.quad(a, b - a, Point(0.0, 0.0, height_m + steps), panel, Uv(0.0, 0.0));
    builder.set_frame(maker.upright(s, sign * (maker.profile(s).edge(right) + kBarrierOut_m),
                                    verge_m(maker, s, right, kBarrierOut_m)));
    builder.box(Point(-0.12, -0.16, -0.5), Point(0.12, 0.16, height_m + 0.15), posts);
  }
  builder.set_frame({});
}

void add_delineators(Maker& maker, double begin_m, double end_m, bool right) {
  constexpr double kEvery_m = 50.0;
  const double sign = right ? -1.0 : 1.0;
  for (const double s : steps(std::ceil(begin_m / kEvery_m) * kEvery_m, end_m, kEvery_m)) {
    RigidTransform T = maker.upright(s, sign * (maker.profile(s).edge(right) + 0.5));
    if (!right) {
      T.R.col(0) *= -1.0;
      T.R.col(1) *= -1.0;
    }
    maker.put(maker.prototypes.delineator, T,
              maker.draw(0xDE11, static_cast<std::uint64_t>(s + 1e4)));
  }
}

}  // namespace

void make_barriers(Maker& maker, double begin_m, double end_m) {
  Random random(maker.draw(0xBA22, static_cast<std::uint64_t>(begin_m + 1e4)));
  for (const bool right : {true, false}) {
    const double sign = right ? -1.0 : 1.0;
    add_delineators(maker, begin_m, end_m, right);
    double s = begin_m + random.uniform(0.0, 20.0);
    while (s < end_m - 12.0) {
      const double length_m = std::min(random.uniform(40.0, 220.0), end_m - s);
      if (random.chance(0.6)) {
        add_rail(
            maker, s, s + length_m,
            [&](double at) { return sign * (maker.profile(at).edge(right) + kRailOut_m); }, -sign,
            random.next());
      }
      if (random.chance(0.3)) {
        add_noise_barrier(maker, s, s + length_m, right, random);
      }
      s += length_m + random.uniform(0.0, 60.0);
    }
    // The median's rails, back to back.
    double from_m = begin_m;
    while (from_m < end_m && maker.profile(from_m).median_half_m < 0.9) {
      from_m += 1.0;
    }
    if (end_m - from_m > 4.0) {
      add_rail(
          maker, from_m, end_m, [&](double) { return sign * 0.35; }, sign, random.next());
    }
  }
}

}  // namespace topoloc::world

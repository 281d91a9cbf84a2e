// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/journey.hpp"
#include "topoloc/world/random.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace topoloc::simulation {
namespace {

constexpr double kAfterBegin_m = 25.0;  // no stop before
constexpr double kBeforeEnd_m = 12.0;   // nor behind
constexpr double kShortTown_m = 60.0;

bool town(const world::Route& route, double along_m) {
  return route.setting(along_m) == world::Setting::kTown;
}

/// First and last place in town where a stop is possible.
struct TownPlaces {
  double first_m;
  double last_m;
};

std::optional<TownPlaces> town_places(const world::Route& route, double from_m, double to_m) {
  std::optional<TownPlaces> places;
  const auto metres = static_cast<int>(std::floor(std::max(0.0, to_m - from_m)));
  for (int i = 0; i <= metres; ++i) {
    const double at_m = from_m + i;
    if (town(route, at_m)) {
      places = {places ? places->first_m : at_m, at_m};
    }
  }
  return places;
}

std::vector<double> stop_places(const world::Route& route, double from_m, double to_m,
                                world::Random& random) {
  std::vector<double> places;
  const double last_m = to_m - kBeforeEnd_m;
  double at_m = from_m + random.uniform(60.0, 220.0);
  while (at_m < last_m) {
    if (town(route, at_m)) {
      places.push_back(at_m);
    }
    at_m += random.uniform(120.0, 320.0);
  }
  const auto possible = town_places(route, from_m + kAfterBegin_m, last_m);
  const bool worth_it = to_m - from_m >= kShortTown_m && possible;
  if (places.empty() && worth_it) {
    const double wanted_m = random.uniform(possible->first_m, possible->last_m);
    places.push_back(town(route, wanted_m) ? wanted_m : possible->first_m);
  }
  return places;
}

}  // namespace

std::vector<Leg> plan_legs(const world::Route& route, double from_m, double to_m,
                           double last_stand_s, std::uint64_t key) {
  world::Random random(key);
  const std::vector<double> stops = stop_places(route, from_m, to_m, random);
  const int backs_up_at = stops.empty() ? -1 : random.below(static_cast<int>(stops.size()));
  std::vector<Leg> legs;
  double here_m = from_m;
  for (std::size_t i = 0; i < stops.size(); ++i) {
    const double stand_s = random.uniform(2.0, 6.0);
    legs.push_back({here_m, stops[i], stand_s});
    here_m = stops[i];
    if (static_cast<int>(i) == backs_up_at) {
      const double back_m = random.uniform(3.0, 5.0);
      legs.push_back({here_m, here_m - back_m, random.uniform(1.5, 3.0)});
      here_m -= back_m;
    }
  }
  legs.push_back({here_m, to_m, last_stand_s});
  return legs;
}

}  // namespace topoloc::simulation

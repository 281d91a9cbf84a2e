// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/bump.hpp"
#include "world/house.hpp"
#include "world/steps.hpp"
#include "world/town_lots.hpp"
#include "world/world_maker.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::world {
namespace {

constexpr double kStraight_1pm = 0.003;  // side streets leave where the road is straight

bool room_for_side_street(const Maker& maker, double s) {
  for (const double ds : steps(-9.0, 9.0 + 1e-9, 3.0)) {
    if (std::abs(maker.world.route.curvature_1pm(s + ds)) > kStraight_1pm ||
        maker.profile(s + ds).parking_m < 2.0) {
      return false;
    }
  }
  const auto piece = static_cast<std::int64_t>(std::floor(s / kSpeedBumpPiece_m));
  for (std::int64_t p = piece - 1; p <= piece + 1; ++p) {
    const auto bump =
        speed_bump_in(maker.world.spec.seed, maker.world.route, maker.world.sections, p);
    if (bump && std::abs(*bump - s) < 16.0) {
      return false;
    }
  }
  return true;
}

// Places along a kerb where nothing else is.
void add_parking(Maker& maker, const Section& section) {
  constexpr double kKerbPlace_m = 6.0;
  for (const bool right : {true, false}) {
    for (const double s : steps(maker.begin_m(section) + 3.0, maker.end_m(section), kKerbPlace_m)) {
      const Profile profile = maker.profile(s);
      const bool crossing = std::any_of(maker.crossings.begin(), maker.crossings.end(),
                                        [&](double c) { return std::abs(c - s) < 7.5; });
      if (crossing || profile.parking_m < 1.95 || !maker.open(s, right, 5.0) ||
          std::abs(maker.world.route.curvature_1pm(s)) > 0.02) {
        continue;
      }
      const double sign = right ? -1.0 : 1.0;
      RigidTransform T = maker.world.route.T_world_road(s);
      T.p = T * Point(0.0, sign * (profile.edge(right) - 1.02),
                      maker.world.bump_m(s, sign * (profile.edge(right) - 1.02)));
      if (!right) {  // cars face the way of the traffic on their side
        T.R.col(0) *= -1.0;
        T.R.col(1) *= -1.0;
      }
      maker.world.parking.push_back({T, kKerbPlace_m});
    }
  }
}

}  // namespace

void plan_town(Maker& maker, const Section& section) {
  Random random(maker.draw(0x70, section.seed));
  double s = maker.begin_m(section) + random.uniform(25.0, 45.0);
  while (s < maker.end_m(section) - 20.0) {
    if (!room_for_side_street(maker, s)) {
      s += 4.0;
      continue;
    }
    const int kind = random.below(4);  // cross roads twice as often as either side alone
    for (const bool right : {true, false}) {
      if (kind >= 2 || (kind == 0) == right) {
        maker.side_streets.push_back({s, right, random.uniform(42.0, 75.0),
                                      random.uniform(0.0, 0.035),
                                      static_cast<std::uint32_t>(random.next())});
      }
    }
    const double crossing = s + (random.chance(0.5) ? 1.0 : -1.0) * (kOpeningHalf_m + 3.2);
    if (random.chance(0.75) && maker.profile(crossing).footway_m > 2.2) {
      maker.crossings.push_back(crossing);
    }
    s += random.uniform(55.0, 105.0);
  }
}

void make_town(Maker& maker, const Section& section) {
  add_parking(maker, section);
  make_town_lots(maker, section);
  make_footway_things(maker, section);
}

}  // namespace topoloc::world

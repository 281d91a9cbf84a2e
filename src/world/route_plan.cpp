// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/route_plan.hpp"

#include "topoloc/world/random.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace topoloc::world {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kShortest_m = 20.0;

/// What a setting's road is made of.
struct Habits {
  Setting setting = Setting::kTown;
  double straight_from_m = 60.0;
  double straight_to_m = 150.0;
  double steepest = 0.05;
  double slope_change_1pm = 0.0012;
  double heading_limit_rad = 0.0;
};

Habits habits_of(Setting setting) {
  switch (setting) {
    case Setting::kTown:
      return {setting, 55.0, 130.0, 0.055, 0.0012, 82.0 * kDegree};
    case Setting::kHighway:
      return {setting, 60.0, 220.0, 0.045, 0.0003, 55.0 * kDegree};
    case Setting::kTunnel:
      return {setting, 80.0, 200.0, 0.03, 0.0003, 55.0 * kDegree};
  }
  return {};
}

class Planner {
 public:
  explicit Planner(std::uint64_t seed) : random_(seed) {}

  void add(Setting setting, double length_m) {
    const Habits habits = habits_of(setting);
    double rest_m = length_m;
    bool straight = true;
    // A short part gets shorter legs, so that it has a curve as well.
    const double scale = std::clamp(length_m / 300.0, 0.45, 1.0);
    while (rest_m > kShortest_m) {
      if (straight) {
        const double leg_m = scale * random_.uniform(habits.straight_from_m, habits.straight_to_m);
        rest_m -= append(habits, std::min(leg_m, rest_m), 0.0);
      } else {
        rest_m -= bend(habits, rest_m);
      }
      straight = !straight;
    }
    if (rest_m > 0.0) {
      append(habits, rest_m, 0.0);
    }
  }

  [[nodiscard]] std::vector<Stretch> stretches() const { return stretches_; }

 private:
  double append(const Habits& habits, double length_m, double end_curvature_1pm) {
    const double change = habits.slope_change_1pm * length_m;
    const double wished = random_.uniform(-habits.steepest, habits.steepest);
    slope_ += std::clamp(wished - slope_, -change, change);
    stretches_.push_back({habits.setting, length_m, end_curvature_1pm, slope_});
    return length_m;
  }

  // Clothoid, arc, clothoid; its length, or 0 where it does not fit.
  double bend(const Habits& habits, double rest_m) {
    double radius_m = random_.uniform(400.0, 1100.0);
    double angle = random_.uniform(4.0, 22.0) * kDegree;
    double ramp_m = 70.0;
    if (habits.setting == Setting::kTown) {
      const bool junction = random_.chance(0.45);
      radius_m = junction ? random_.uniform(17.0, 24.0) : random_.uniform(50.0, 160.0);
      angle = (junction ? random_.uniform(60.0, 85.0) : random_.uniform(10.0, 32.0)) * kDegree;
      ramp_m = junction ? 9.0 : 14.0;
    }
    bool left = random_.chance(0.5);
    if (std::abs(heading_ + (left ? angle : -angle)) > habits.heading_limit_rad) {
      left = !left;
    }
    if (std::abs(heading_ + (left ? angle : -angle)) > habits.heading_limit_rad) {
      return 0.0;
    }
    ramp_m = std::min(ramp_m, 0.8 * radius_m * angle);
    const double arc_m = radius_m * angle - ramp_m;
    const double whole_m = 2.0 * ramp_m + arc_m;
    if (whole_m > rest_m) {
      // What is left becomes half a bend: ramps only, as sharp as the radius allows.
      return rest_m > 3.0 * kShortest_m ? half_bend(habits, rest_m, radius_m, left) : 0.0;
    }
    const double curvature = (left ? 1.0 : -1.0) / radius_m;
    append(habits, ramp_m, curvature);
    append(habits, arc_m, curvature);
    append(habits, ramp_m, 0.0);
    heading_ += left ? angle : -angle;
    return whole_m;
  }

  double half_bend(const Habits& habits, double rest_m, double radius_m, bool left) {
    const double ramp_m = 0.3 * rest_m;
    const double curvature =
        (left ? 1.0 : -1.0) * std::min(1.0 / radius_m, 20.0 * kDegree / ramp_m);
    append(habits, ramp_m, curvature);
    append(habits, ramp_m, 0.0);
    heading_ += curvature * ramp_m;
    return 2.0 * ramp_m;
  }

  Random random_;
  std::vector<Stretch> stretches_;
  double heading_ = 0.0;
  double slope_ = 0.0;
};

}  // namespace

Route plan_route(const WorldSpec& spec) {
  if (!(spec.length_m >= 50.0 && spec.length_m <= 50000.0)) {
    throw std::invalid_argument("a world's road is between 50 m and 50 km long");
  }
  Planner planner(key(spec.seed, {0x407E}));
  const double length_m = spec.length_m;
  switch (spec.scenario) {
    case Scenario::kTown:
      planner.add(Setting::kTown, length_m);
      break;
    case Scenario::kHighway:
      planner.add(Setting::kHighway, length_m);
      break;
    case Scenario::kTunnel: {
      const double open_m = std::min(90.0, 0.15 * length_m);  // before and after it
      planner.add(Setting::kHighway, open_m);
      planner.add(Setting::kTunnel, length_m - 2.0 * open_m);
      planner.add(Setting::kHighway, open_m);
      break;
    }
    case Scenario::kMixed:
      planner.add(Setting::kTown, 0.34 * length_m);
      planner.add(Setting::kHighway, 0.22 * length_m);
      planner.add(Setting::kTunnel, 0.24 * length_m);
      planner.add(Setting::kHighway, 0.2 * length_m);
      break;
  }
  return Route(planner.stretches());
}

}  // namespace topoloc::world

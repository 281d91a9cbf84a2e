// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/world/world.hpp"

#include "world/bump.hpp"
#include "world/profile.hpp"
#include "world/route_plan.hpp"
#include "world/world_maker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace topoloc::world {
namespace {

constexpr std::array<std::string_view, 4> kNames{"town", "highway", "tunnel", "mixed"};
constexpr double kLateral_mps2 = 2.2;  // what a careful driver takes in a bend

// Of the path of the first lane: the road's, and what the lane does within it.
double ego_curvature(const World& world, double along_m) {
  constexpr double kStep_m = 4.0;
  const auto offset = [&](double s) { return profile_at(world.sections, s).lane_middle(true, 0); };
  const double here = offset(along_m);
  const double second =
      (offset(along_m - kStep_m) - 2.0 * here + offset(along_m + kStep_m)) / (kStep_m * kStep_m);
  const double road = world.route.curvature_1pm(along_m);
  return road / std::max(0.2, 1.0 - road * here) + second;
}

}  // namespace

std::string_view name(Scenario scenario) { return kNames[static_cast<std::size_t>(scenario)]; }

Scenario scenario_of(std::string_view name) {
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) {
    std::string message = "no scenario is called '" + std::string(name) + "'; there are";
    for (const std::string_view known : kNames) {
      message += " " + std::string(known);
    }
    throw std::invalid_argument(message);
  }
  return static_cast<Scenario>(found - kNames.begin());
}

std::vector<Lane> World::lanes(double along_m) const {
  const Profile profile = profile_at(sections, along_m);
  const Section& section = section_at(sections, along_m);
  std::vector<Lane> result;
  for (int slot = 0; slot < kSlots; ++slot) {
    if (profile.right_m[static_cast<std::size_t>(slot)] > kLaneOpen_m) {
      result.push_back(
          {profile.lane_middle(true, slot), true, lane_speed_mps(section, true, slot)});
    }
  }
  for (int slot = kSlots - 1; slot >= 0; --slot) {
    if (section.two_way && profile.left_m[static_cast<std::size_t>(slot)] > kLaneOpen_m) {
      result.push_back(
          {profile.lane_middle(false, slot), false, lane_speed_mps(section, false, slot)});
    }
  }
  return result;
}

double World::speed_limit_mps(double along_m) const {
  constexpr double kSlowest_mps = 4.0;
  double curvature = 0.0;
  for (const double ahead_m : {-4.0, 0.0, 4.0}) {
    curvature = std::max(curvature, std::abs(ego_curvature(*this, along_m + ahead_m)));
  }
  double limit_mps = section_at(sections, along_m).limit_mps;
  const auto piece = static_cast<std::int64_t>(std::floor(along_m / kSpeedBumpPiece_m));
  if (const auto bump_m_ = speed_bump_in(spec.seed, route, sections, piece)) {
    if (std::abs(along_m - *bump_m_) < 2.0 * kSpeedBumpHalf_m) {
      limit_mps = std::min(limit_mps, 7.0);
    }
  }
  return std::clamp(std::sqrt(kLateral_mps2 / std::max(curvature, 1e-5)), kSlowest_mps, limit_mps);
}

double World::bump_m(double along_m, double left_m) const {
  return bump_at(spec.seed, route, sections, along_m, left_m);
}

World make_world(const WorldSpec& spec) {
  World world;
  world.spec = spec;
  world.route = plan_route(spec);
  world.sections = make_sections(spec, world.route);
  world.meshes.emplace_back();
  Maker maker(world);
  make_prototypes(maker);
  make_cars(maker);
  for (const Section& section : world.sections) {
    if (section.setting == Setting::kTown) {
      plan_town(maker, section);
    }
  }
  make_road(maker);
  make_markings(maker);
  make_side_streets(maker);
  for (const Section& section : world.sections) {
    switch (section.setting) {
      case Setting::kTown:
        make_town(maker, section);
        break;
      case Setting::kHighway:
        make_highway(maker, section);
        break;
      case Setting::kTunnel:
        make_tunnel(maker, section);
        break;
    }
  }
  make_terrain(maker);
  return world;
}

}  // namespace topoloc::world

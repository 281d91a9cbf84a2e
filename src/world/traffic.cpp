// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "world/traffic.hpp"

#include "topoloc/world/random.hpp"

#include "world/noise.hpp"
#include "world/profile.hpp"
#include "world/steps.hpp"
#include "world/vehicle_size.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace topoloc::world {
namespace {

constexpr std::size_t kStreams = std::size_t{2} * kSlots;
constexpr double kTable_m = 2.0;      // between places of the table of times
constexpr double kOutside_m = 400.0;  // road on which there is traffic before and after the route
constexpr double kSeenBehind_m = 130.0;  // vehicles are told of from here
constexpr double kSeenAhead_m = 360.0;   // to here
constexpr double kHeadway_s = 1.7;       // at least, from front to front

struct Stream {
  bool right;
  int slot;
};
Stream stream_of(std::size_t index) { return {index < kSlots, static_cast<int>(index % kSlots)}; }

bool open_at(const World& world, const Stream& stream, double along_m) {
  constexpr double kMargin_m = 12.0;
  const auto slot = static_cast<std::size_t>(stream.slot);
  for (const double ds : {-kMargin_m, 0.0, kMargin_m}) {
    const Profile profile = profile_at(world.sections, along_m + ds);
    if ((stream.right ? profile.right_m : profile.left_m)[slot] < kLaneOpen_m) {
      return false;
    }
  }
  return stream.right || section_at(world.sections, along_m).two_way;
}

double time_at(const std::vector<double>& times, double along_m) {
  const double place =
      std::clamp((along_m + kOutside_m) / kTable_m, 0.0, static_cast<double>(times.size()) - 1.001);
  const auto i = static_cast<std::size_t>(place);
  return std::lerp(times[i], times[i + 1], place - static_cast<double>(i));
}

double place_at(const std::vector<double>& times, double time_s) {
  const auto next = std::lower_bound(times.begin() + 1, times.end() - 1, time_s);
  const auto i = static_cast<std::size_t>(next - times.begin()) - 1;
  const double share = (time_s - times[i]) / (times[i + 1] - times[i]);
  return (static_cast<double>(i) + share) * kTable_m - kOutside_m;
}

std::uint32_t model_for(const World& world, Random& random, const Stream& stream, double along_m) {
  const bool town = section_at(world.sections, along_m).setting == Setting::kTown;
  const auto count = static_cast<int>(world.car_meshes.size());
  const double heavy = town ? 0.1 : (stream.slot == 0 ? 0.3 : 0.02);
  const int index = random.chance(heavy) ? count - 1 - random.below(kHeavyModels)
                                         : random.below(count - kHeavyModels);
  return world.car_meshes[static_cast<std::size_t>(index)];
}

// A vehicle on its lane; `along_m` is the middle of its rear axle.
Instance on_lane(const World& world, const Stream& stream, std::uint32_t mesh, double along_m,
                 std::uint64_t seed) {
  const auto offset = [&](double s) {
    return profile_at(world.sections, s).lane_middle(stream.right, stream.slot);
  };
  constexpr double kStep_m = 1.0;
  const double left = offset(along_m);
  const double yaw =
      std::atan((offset(along_m + kStep_m) - offset(along_m - kStep_m)) / (2.0 * kStep_m));
  RigidTransform T_road_car;
  // Nobody keeps exactly to the middle.
  const double own = 0.5 * (noise::unit(static_cast<std::uint32_t>(seed)) - 0.5);
  T_road_car.p = Eigen::Vector3d(0.0, left + own, world.bump_m(along_m, left + own));
  T_road_car.R =
      Eigen::AngleAxisd(stream.right ? yaw : yaw + std::numbers::pi, Eigen::Vector3d::UnitZ())
          .toRotationMatrix();
  return {mesh, world.route.T_world_road(along_m) * T_road_car, 1.0F,
          static_cast<std::uint32_t>(seed >> 32U)};
}

// How far the vehicle ahead is off: near for a while, then it draws away and is caught up with
// again. Changes more slowly than the way itself, so that the vehicle drives on as the ego vehicle
// does; where that backs up, it makes room, backwards.
double gap_m(std::uint64_t seed, double ego_along_m, double near_from_m, double near_to_m) {
  constexpr double kNear_m = 330.0;
  constexpr double kAway_m = 340.0;
  // What is breathed, at most 1.5 (noise's steepest) x 35 m / kBreath_m = 0.375, comes on top.
  constexpr double kRate = 0.55;
  constexpr double kBreath_m = 140.0;
  Random random(seed);
  const double period_m = kNear_m + kAway_m;
  const double phase = ego_along_m + random.uniform(0.0, 0.6 * kNear_m);
  const double within = phase - std::floor(phase / period_m) * period_m;
  const double away = std::max(0.0, kRate * std::min(within - kNear_m, period_m - within));
  const double breathing = noise::value(static_cast<float>(ego_along_m / kBreath_m), 0.5F,
                                        static_cast<std::uint32_t>(random.next()));
  return std::lerp(near_from_m, near_to_m, breathing) + away;
}

std::size_t ego_stream(const World& world, double along_m, double left_m) {
  const Profile profile = profile_at(world.sections, along_m);
  std::size_t best = 0;
  double nearest = 1e9;
  for (std::size_t i = 0; i < kStreams; ++i) {
    const Stream stream = stream_of(i);
    const auto slot = static_cast<std::size_t>(stream.slot);
    if ((stream.right ? profile.right_m : profile.left_m)[slot] > 1.0) {
      const double distance = std::abs(profile.lane_middle(stream.right, stream.slot) - left_m);
      if (distance < nearest) {
        nearest = distance;
        best = i;
      }
    }
  }
  return best;
}

}  // namespace

std::vector<std::vector<double>> travel_times(const World& world) {
  std::vector<std::vector<double>> result(kStreams);
  for (std::size_t i = 0; i < result.size(); ++i) {
    double time_s = 0.0;
    for (const double s : steps(-kOutside_m, world.route.length_m() + kOutside_m, kTable_m)) {
      result[i].push_back(time_s);
      const Stream stream = stream_of(i);
      time_s += kTable_m / lane_speed_mps(section_at(world.sections, s), stream.right, stream.slot);
    }
  }
  return result;
}

std::vector<Instance> Visit::moving(double time_s, double ego_along_m, double ego_left_m) const {
  std::vector<Instance> result;
  if (world_->car_meshes.empty() || spec_.traffic_per_km <= 0.0) {
    return result;
  }
  const std::size_t own = ego_stream(*world_, ego_along_m, ego_left_m);
  for (std::size_t i = 0; i < kStreams; ++i) {
    if (i == own) {
      continue;
    }
    const Stream stream = stream_of(i);
    const std::vector<double>& times = travel_s_[i];
    // As many on each lane as if there were two; from the mean speed, since the spacing in time
    // must not change while one drives.
    constexpr double kLanes = 2.0;
    const double mean_mps = (world_->route.length_m() + 2.0 * kOutside_m) / times.back();
    const double spacing_s =
        std::max(2.0 * kHeadway_s, kLanes * 1000.0 / (spec_.traffic_per_km * mean_mps));
    const double way = stream.right ? time_s : -time_s;
    const double from = time_at(times, ego_along_m - kSeenBehind_m) - way;
    const double to = time_at(times, ego_along_m + kSeenAhead_m) - way;
    for (auto k = static_cast<std::int64_t>(std::floor(from / spacing_s)) - 1;
         static_cast<double>(k - 1) * spacing_s < to; ++k) {
      const std::uint64_t seed = key(spec_.seed, {0x7AF1, i, static_cast<std::uint64_t>(k)});
      Random random(seed);
      const double jitter = random.uniform(0.0, spacing_s - kHeadway_s);
      const double at_s = static_cast<double>(k) * spacing_s + jitter + way;
      if (at_s <= times.front() || at_s >= times.back()) {
        continue;
      }
      const double along_m = place_at(times, at_s);
      if (along_m < ego_along_m - kSeenBehind_m || along_m > ego_along_m + kSeenAhead_m ||
          !open_at(*world_, stream, along_m)) {
        continue;
      }
      const double left_m =
          profile_at(world_->sections, along_m).lane_middle(stream.right, stream.slot);
      constexpr double kKeepAside_m = 2.7;
      constexpr double kKeepAlong_m = 18.0;
      if (std::abs(left_m - ego_left_m) < kKeepAside_m &&
          std::abs(along_m - ego_along_m) < kKeepAlong_m) {
        continue;
      }
      // The model does not change on the way: chosen for where the route begins.
      const std::uint32_t mesh = model_for(*world_, random, stream, 0.0);
      result.push_back(on_lane(*world_, stream, mesh, along_m, random.next()));
    }
  }
  // Ahead of the ego vehicle and behind it, in its lane.
  const Stream stream = stream_of(own);
  Random random(key(spec_.seed, {0x1EAD}));
  const std::uint32_t ahead_mesh = model_for(*world_, random, stream, 0.0);
  constexpr double kEgoFront_m = 3.8;
  constexpr double kEgoRear_m = 1.2;
  const double ahead_m = ego_along_m + kEgoFront_m +
                         gap_m(key(spec_.seed, {0x1EAE}), ego_along_m, 20.0, 55.0) -
                         size_of(world_->meshes[ahead_mesh]).rear_m;
  const std::uint32_t behind_mesh =
      world_->car_meshes[static_cast<std::size_t>(random.below(kLightModels))];
  const double behind_m = ego_along_m - kEgoRear_m -
                          gap_m(key(spec_.seed, {0x1EAF}), ego_along_m + 200.0, 14.0, 35.0) -
                          size_of(world_->meshes[behind_mesh]).front_m;
  const std::uint64_t paint = random.next();
  result.push_back(on_lane(*world_, stream, ahead_mesh, ahead_m, paint));
  result.push_back(on_lane(*world_, stream, behind_mesh, behind_m, paint * 3U));
  return result;
}

}  // namespace topoloc::world

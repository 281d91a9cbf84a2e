// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/ego.hpp"

#include "topoloc/geometry/so3.hpp"
#include "topoloc/world/random.hpp"

#include "simulation/suspension.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace topoloc::simulation {
namespace {

constexpr double kControl_s = 0.05;  // between control poses
constexpr int kSubsteps = 10;        // of the suspension between them
constexpr double kShortest_m = 20.0;

/// The way along the route and its derivatives, at a moment.
struct AlongRoute {
  double along_m;
  double speed_mps;
  double acceleration_mps2;
};

AlongRoute along_route(const Path& path, const Journey& journey, double time_s) {
  constexpr double kStep_s = 0.05;
  const double before = journey.along_m(time_s - kStep_s);
  const double now = journey.along_m(time_s);
  const double after = journey.along_m(time_s + kStep_s);
  const double stretch = path.stretch(now);
  return {.along_m = now,
          .speed_mps = stretch * (after - before) / (2.0 * kStep_s),
          .acceleration_mps2 = stretch * (after - 2.0 * now + before) / (kStep_s * kStep_s)};
}

WheelHeights under_wheels(const Road& road, const VehicleModel& vehicle, double along_m,
                          double left_m) {
  const double half = 0.5 * vehicle.track_m;
  const double front_m = along_m + vehicle.wheelbase_m;
  return {.front_left = road.bump_m(front_m, left_m + half),
          .front_right = road.bump_m(front_m, left_m - half),
          .rear_left = road.bump_m(along_m, left_m + half),
          .rear_right = road.bump_m(along_m, left_m - half)};
}

std::vector<RigidTransform> control_poses(const Road& road, const VehicleModel& vehicle,
                                          const Path& path, const Journey& journey) {
  Suspension suspension(vehicle);
  const auto count = static_cast<int>(std::floor(journey.duration_s() / kControl_s)) + 3;
  std::vector<RigidTransform> controls;
  controls.reserve(static_cast<std::size_t>(count));
  constexpr double kStep_s = kControl_s / kSubsteps;
  for (int i = -kSubsteps; i < (count - 1) * kSubsteps; ++i) {
    const double time_s = i * kStep_s;
    const AlongRoute now = along_route(path, journey, time_s);
    const WheelHeights heights = under_wheels(road, vehicle, now.along_m, path.left_m(now.along_m));
    const double left_mps2 = now.speed_mps * now.speed_mps * path.curvature_1pm(now.along_m);
    if (i == -kSubsteps) {
      suspension.settle(heights, now.acceleration_mps2, left_mps2);
    } else {
      suspension.step(heights, now.acceleration_mps2, left_mps2, kStep_s);
    }
    if (i % kSubsteps == 0) {
      RigidTransform pose = path.T_world_path(now.along_m);
      pose.p += suspension.heave_m() * pose.R.col(2);
      pose.R *= so3::from_roll_pitch_yaw({suspension.roll_rad(), suspension.pitch_rad(), 0.0});
      controls.push_back(pose);
    }
  }
  return controls;
}

}  // namespace

Ego drive_along(const Road& road, const EgoSpec& spec, std::uint64_t key) {
  const double to_m = road.route->length_m() - spec.before_end_m;
  if (to_m - spec.from_m < kShortest_m) {
    throw std::invalid_argument("a road of " + std::to_string(road.route->length_m()) +
                                " m is too short to drive on");
  }
  Path path(road, spec.path, world::key(key, {1}));
  const std::vector<Leg> legs =
      plan_legs(*road.route, spec.from_m, to_m, spec.style.last_stand_s, world::key(key, {2}));
  Journey journey(path, road, legs, spec.style, world::key(key, {3}));
  Trajectory trajectory(control_poses(road, spec.vehicle, path, journey), kControl_s);
  return {
      .path = std::move(path), .journey = std::move(journey), .trajectory = std::move(trajectory)};
}

}  // namespace topoloc::simulation

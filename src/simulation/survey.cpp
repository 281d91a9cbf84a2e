// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/survey.hpp"

#include "topoloc/simulation/voxel_filter.hpp"
#include "topoloc/world/random.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace topoloc::simulation {
namespace {

/// Much farther than a place is seen from.
constexpr double kRemember_m = 150.0;

double edge_m(const SurveySpec& spec, double distance_m) {
  return distance_m < spec.near_m     ? spec.near_edge_m
         : distance_m < spec.middle_m ? spec.middle_edge_m
                                      : spec.far_edge_m;
}

/// The vehicle itself and its rack: not surveyed.
constexpr double kBlind_m = 1.0;

}  // namespace

SurveyCounts survey(rendering::Raycaster& raycaster, const Ego& ego, const world::Visit& visit,
                    const RigidTransform& T_vehicle_lidar, const SurveySpec& spec,
                    std::int64_t begin_ns, std::uint64_t key,
                    const std::function<void(const SurveyPoint&)>& write,
                    const std::function<void(double)>& progress) {
  const PoseError error(spec.poses, world::key(key, {1}));
  VoxelFilter filter(kRemember_m);
  SurveyCounts counts;
  const double turn_s = 1.0 / spec.lidar.rate_hz;
  double way_m = 0.0;  // driven, forwards or backwards
  double last_m = ego.along_m(0.0);
  double next_m = 0.0;  // of the next scan
  if (!(spec.spacing_m > 0.0)) {
    throw std::invalid_argument("survey: scans without a spacing");
  }
  const auto turns = static_cast<std::int64_t>(std::floor(ego.duration_s() / turn_s));
  for (std::int64_t turn = 0; turn < turns; ++turn) {
    const double begin_s = static_cast<double>(turn) * turn_s;
    const double along_m = ego.along_m(begin_s);
    way_m += std::abs(along_m - last_m);
    last_m = along_m;
    if (way_m < next_m) {
      continue;
    }
    // From where a scan was due, not from where the scanner came round to it: else every scan
    // would be late by what the last one was late.
    while (next_m <= way_m) {
      next_m += spec.spacing_m;
    }
    filter.advance(way_m);
    raycaster.place_moving(visit.moving(begin_s, along_m, ego.path.left_m(along_m)));
    const auto T_world_lidar = [&](double since_s) {
      return ego.trajectory.at(begin_s + since_s).T_world_body * T_vehicle_lidar;
    };
    const auto points = rendering::scan(raycaster, spec.lidar, T_world_lidar,
                                        world::key(key, {2, static_cast<std::uint64_t>(turn)}));
    ++counts.scans;
    counts.returns += points.size();
    RigidTransform T_world_lidar_believed;
    std::int32_t posed_ns = -1;
    for (const rendering::LidarPoint& point : points) {
      const auto distance_m = static_cast<double>(point.p_lidar_m.norm());
      if (distance_m < kBlind_m) {
        continue;
      }
      if (point.after_ns != posed_ns) {  // points come by column
        posed_ns = point.after_ns;
        const double time_s = begin_s + 1e-9 * posed_ns;
        T_world_lidar_believed =
            error.disturbed(ego.trajectory.at(time_s).T_world_body, time_s) * T_vehicle_lidar;
      }
      const SurveyPoint out{.p_world_m = T_world_lidar_believed * point.p_lidar_m.cast<double>(),
                            .intensity = point.intensity,
                            .time_ns = begin_ns + std::llround(begin_s * 1e9) + point.after_ns};
      if (filter.keep(out.p_world_m, edge_m(spec, distance_m))) {
        write(out);
        ++counts.points;
        counts.moving_points += point.moving ? 1 : 0;
      }
    }
    progress(static_cast<double>(turn + 1) / static_cast<double>(turns));
  }
  raycaster.place_moving({});
  return counts;
}

}  // namespace topoloc::simulation

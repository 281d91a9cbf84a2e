// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/gnss.hpp"

#include "topoloc/geometry/so3.hpp"
#include "topoloc/world/random.hpp"

#include "simulation/normal3.hpp"

#include <cmath>

namespace topoloc::simulation {
namespace {

Eigen::Vector3d level_and_up(world::Random& random, double horizontal, double vertical) {
  return normal3(random).cwiseProduct(Eigen::Vector3d(horizontal, horizontal, vertical));
}

/// A reflected signal is taken for a while.
class Multipath {
 public:
  Multipath(const GnssSpec& spec, std::uint64_t key) : spec_(spec), random_(key) {}

  Eigen::Vector3d error(double time_s, bool town) {
    if (time_s >= until_s_) {
      jump_.setZero();
      if (town && random_.chance(spec_.jumps_per_min / 60.0 / spec_.rate_hz)) {
        jump_ = level_and_up(random_, spec_.jump_m, 1.5 * spec_.jump_m);
        until_s_ = time_s + random_.uniform(2.0, 12.0);
      }
    }
    return jump_;
  }

 private:
  GnssSpec spec_;
  world::Random random_;
  Eigen::Vector3d jump_ = Eigen::Vector3d::Zero();
  double until_s_ = 0.0;
};

}  // namespace

evaluation::Trajectory sense_satellites(const Ego& ego, const RigidTransform& T_vehicle_imu,
                                        const world::Route& route, const GnssSpec& spec,
                                        std::uint64_t key) {
  world::Random random(world::key(key, {1}));
  Multipath multipath(spec, world::key(key, {2}));
  Eigen::Vector3d wander = level_and_up(random, spec.horizontal_m, spec.vertical_m);
  const double kept = std::exp(-1.0 / (spec.rate_hz * spec.correlation_s));
  const double renewed = std::sqrt(1.0 - kept * kept);
  constexpr double kCourse_mps = 2.0;  // slower, or backing up: the course before
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  bool has_course = false;
  evaluation::Trajectory fixes;
  const auto count = static_cast<std::int64_t>(std::floor(ego.duration_s() * spec.rate_hz));
  for (std::int64_t i = 0; i <= count; ++i) {
    const double time_s = static_cast<double>(i) / spec.rate_hz;
    const BodyMotion body = ego.trajectory.at(time_s);
    const BodyMotion imu = body.of(T_vehicle_imu);
    const world::Setting setting = route.setting(ego.along_m(time_s));
    wander = kept * wander + renewed * level_and_up(random, spec.horizontal_m, spec.vertical_m);
    const Eigen::Vector3d white = spec.white_m * level_and_up(random, 1.0, 1.5);
    const Eigen::Vector3d jump = multipath.error(time_s, setting == world::Setting::kTown);
    const double course_error = 0.02 * random.normal();
    if (body.velocity_mps.head<2>().norm() > kCourse_mps || !has_course) {
      const Eigen::Vector3d ahead = body.T_world_body.R.col(0);
      const double course = std::atan2(ahead.y(), ahead.x()) + course_error;
      R = so3::from_roll_pitch_yaw({0.0, 0.0, course});
      has_course = true;
    }
    if (setting == world::Setting::kTunnel) {
      continue;
    }
    const RigidTransform fix{R, imu.T_world_body.p + wander + white + jump};
    fixes.push_back({std::llround(time_s * 1e9), fix});
  }
  return fixes;
}

}  // namespace topoloc::simulation

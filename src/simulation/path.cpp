// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/path.hpp"

#include "topoloc/world/random.hpp"

#include "simulation/cubic_weights.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace topoloc::simulation {
namespace {

constexpr double kLane_m = 2.0;         // between control values of the lane's place
constexpr double kLaneChange_m = 40.0;  // where lanes shift, half of the way that this takes
constexpr double kMargin_m = 50.0;      // before the road's begin and behind its end
constexpr double kWander_m = 60.0;      // between changes of mind

}  // namespace

Path::Path(const Road& road, const Options& options, std::uint64_t key)
    : road_(&road),
      offset_m_(world::Random(world::key(key, {1}))
                    .uniform(-options.largest_offset_m, options.largest_offset_m)),
      wander_m_(options.wander_m),
      wander_(world::key(key, {2}), kWander_m) {
  const auto count =
      static_cast<std::size_t>(std::ceil((road.route->length_m() + 2.0 * kMargin_m) / kLane_m)) + 4;
  std::vector<double> raw(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double along_m = static_cast<double>(i) * kLane_m - kMargin_m - kLane_m;
    raw[i] = road.lane_left_m(std::clamp(along_m, 0.0, road.route->length_m()));
  }
  // Where lanes shift the vehicle does so little by little: raised cosine.
  const auto reach = static_cast<std::ptrdiff_t>(kLaneChange_m / kLane_m);
  lane_left_m_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    double sum = 0.0;
    double weights = 0.0;
    for (std::ptrdiff_t j = -reach; j <= reach; ++j) {
      const auto at = std::clamp(static_cast<std::ptrdiff_t>(i) + j, std::ptrdiff_t{0},
                                 static_cast<std::ptrdiff_t>(count) - 1);
      const double weight = 1.0 + std::cos(std::numbers::pi * static_cast<double>(j) /
                                           static_cast<double>(reach + 1));
      sum += weight * raw[static_cast<std::size_t>(at)];
      weights += weight;
    }
    lane_left_m_[i] = sum / weights;
  }
}

Eigen::Vector4d Path::lane_controls(double along_m, double& share) const {
  const double place = std::clamp((along_m + kMargin_m) / kLane_m, 0.0,
                                  static_cast<double>(lane_left_m_.size()) - 4.0);
  const auto first = std::min(static_cast<std::size_t>(place), lane_left_m_.size() - 4);
  share = place - static_cast<double>(first);
  return {lane_left_m_[first], lane_left_m_[first + 1], lane_left_m_[first + 2],
          lane_left_m_[first + 3]};
}

double Path::left_m(double along_m) const {
  double share = 0.0;
  const Eigen::Vector4d lane = lane_controls(along_m, share);
  // The wander stays within its bounds without a kink.
  return lane.dot(cubic_weights(share)) + offset_m_ +
         wander_m_ * std::tanh(0.7 * wander_.value(along_m));
}

double Path::left_slope(double along_m) const {
  double share = 0.0;
  const Eigen::Vector4d lane = lane_controls(along_m, share);
  const double bounded = std::tanh(0.7 * wander_.value(along_m));
  return lane.dot(cubic_weights_1(share)) / kLane_m +
         0.7 * wander_m_ * (1.0 - bounded * bounded) * wander_.slope(along_m);
}

Eigen::Vector3d Path::tangent(double along_m) const {
  const Eigen::Matrix3d R = road_->route->T_world_road(along_m).R;
  const Eigen::Vector3d ahead(R(0, 0), R(1, 0), 0.0);
  // The road's y axis is level and turns with its heading.
  return R.col(0) - road_->route->curvature_1pm(along_m) * left_m(along_m) * ahead.normalized() +
         left_slope(along_m) * R.col(1);
}

double Path::stretch(double along_m) const { return tangent(along_m).norm(); }

RigidTransform Path::T_world_path(double along_m) const {
  const RigidTransform T_world_road = road_->route->T_world_road(along_m);
  RigidTransform pose;
  pose.p = T_world_road * Eigen::Vector3d(0.0, left_m(along_m), 0.0);
  const Eigen::Vector3d x = tangent(along_m).normalized();
  const Eigen::Vector3d y = T_world_road.R.col(2).cross(x).normalized();
  pose.R << x, y, x.cross(y);
  return pose;
}

double Path::curvature_1pm(double along_m) const {
  constexpr double kStep_m = 0.5;
  const Eigen::Vector3d before = tangent(along_m - kStep_m);
  const Eigen::Vector3d after = tangent(along_m + kStep_m);
  const double turn = std::atan2(before.x() * after.y() - before.y() * after.x(),
                                 before.x() * after.x() + before.y() * after.y());
  return turn / (2.0 * kStep_m * stretch(along_m));
}

}  // namespace topoloc::simulation

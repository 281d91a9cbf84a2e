// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/evaluation/pose_errors.hpp"

#include "topoloc/geometry/so3.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace topoloc::evaluation {
namespace {

/// Below this speed a longitudinal error says nothing about time.
constexpr double kMinSpeedForTimeOffset_mps = 1.0;

/// Velocity of the reference at its i-th pose: difference quotient of the neighbours.
Eigen::Vector3d velocity_mps(const Trajectory& trajectory, std::size_t i) {
  const StampedPose& before = trajectory[i == 0 ? 0 : i - 1];
  const StampedPose& after = trajectory[std::min(i + 1, trajectory.size() - 1)];
  const double dt_s = static_cast<double>(after.time_ns - before.time_ns) * kSecondsPerNs;
  if (dt_s <= 0.0) {
    return Eigen::Vector3d::Zero();
  }
  return (after.T_world_imu.p - before.T_world_imu.p) / dt_s;
}

std::int64_t first_counted_ns(const Trajectory& reference, double from_s) {
  constexpr double kMaxFrom_s = 1e9;
  if (!(from_s >= 0.0 && from_s < kMaxFrom_s)) {
    throw std::invalid_argument("the seconds to skip must be a number from 0 on");
  }
  return reference.front().time_ns + std::llround(from_s / kSecondsPerNs);
}

double quantile(const std::vector<double>& sorted, double probability) {
  const double at = probability * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

}  // namespace

Eigen::Matrix3d heading_axes(const Eigen::Matrix3d& R_world_imu) {
  const double heading_rad = std::atan2(R_world_imu(1, 0), R_world_imu(0, 0));
  return so3::exp({0.0, 0.0, heading_rad});
}

MatchedErrors match_errors(const Trajectory& reference, const Trajectory& estimate,
                           const MatchOptions& options) {
  if (reference.empty() || estimate.empty()) {
    throw std::runtime_error("an empty trajectory cannot be compared");
  }
  MatchedErrors result;
  result.begin_ns = first_counted_ns(reference, options.from_s);
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const auto& [time_ns, T_reference] = reference[i];
    if (time_ns < result.begin_ns) {
      continue;
    }
    ++result.reference_poses;
    const auto T_estimate = pose_at(estimate, time_ns, options.max_gap_ns);
    if (!T_estimate) {
      continue;
    }
    const Eigen::Matrix3d R_world_heading = heading_axes(T_reference.R);
    PoseError error;
    error.time_ns = time_ns;
    error.T_world_reference = T_reference;
    error.T_world_estimate = *T_estimate;
    error.heading_error_m = R_world_heading.transpose() * (T_estimate->p - T_reference.p);
    error.rotation_error_rad = so3::log(T_reference.R.transpose() * T_estimate->R);
    error.forward_speed_mps = R_world_heading.col(0).dot(velocity_mps(reference, i));
    result.errors.push_back(error);
  }
  if (result.reference_poses == 0) {
    throw std::runtime_error("no reference pose is left after the seconds to skip");
  }
  if (result.errors.empty()) {
    throw std::runtime_error(
        "the estimate covers no reference stamp: do both use the same clock (Unix seconds)?");
  }
  return result;
}

Statistics statistics(const std::vector<double>& values) {
  if (values.empty()) {
    throw std::invalid_argument("statistics of no values");
  }
  std::vector<double> sorted(values.size());
  std::transform(values.begin(), values.end(), sorted.begin(),
                 [](double value) { return std::abs(value); });
  std::sort(sorted.begin(), sorted.end());
  Statistics result;
  for (const double value : sorted) {
    result.mean += value;
    result.rmse += value * value;
  }
  result.mean /= static_cast<double>(sorted.size());
  result.rmse = std::sqrt(result.rmse / static_cast<double>(sorted.size()));
  result.median = quantile(sorted, 0.5);
  result.p95 = quantile(sorted, 0.95);
  result.max = sorted.back();
  return result;
}

PoseScores score(const MatchedErrors& matched) {
  const auto statistics_of = [&matched](const auto& value_of) {
    std::vector<double> values;
    values.reserve(matched.errors.size());
    for (const PoseError& error : matched.errors) {
      values.push_back(value_of(error));
    }
    return statistics(values);
  };
  PoseScores scores;
  scores.position_m = statistics_of([](const PoseError& e) { return e.position_m(); });
  scores.rotation_rad = statistics_of([](const PoseError& e) { return e.rotation_rad(); });
  scores.longitudinal_m = statistics_of([](const PoseError& e) { return e.heading_error_m.x(); });
  scores.lateral_m = statistics_of([](const PoseError& e) { return e.heading_error_m.y(); });
  scores.vertical_m = statistics_of([](const PoseError& e) { return e.heading_error_m.z(); });
  scores.matched = matched.errors.size();
  scores.reference_poses = matched.reference_poses;
  scores.coverage =
      static_cast<double>(scores.matched) / static_cast<double>(scores.reference_poses);
  const RigidTransform* last = &matched.errors.front().T_world_reference;
  for (const PoseError& error : matched.errors) {
    scores.final_horizontal_m = error.heading_error_m.head<2>().norm();
    scores.max_horizontal_m = std::max(scores.max_horizontal_m, scores.final_horizontal_m);
    scores.travelled_m += (error.T_world_reference.p - last->p).norm();
    last = &error.T_world_reference;
  }
  double speed_times_error = 0.0;
  double speed_squared = 0.0;
  for (const PoseError& error : matched.errors) {
    scores.signed_mean_m += error.heading_error_m / static_cast<double>(scores.matched);
    if (std::abs(error.forward_speed_mps) >= kMinSpeedForTimeOffset_mps) {
      speed_times_error += error.forward_speed_mps * error.heading_error_m.x();
      speed_squared += error.forward_speed_mps * error.forward_speed_mps;
    }
  }
  if (speed_squared > 0.0) {
    scores.time_offset_s = speed_times_error / speed_squared;
  }
  return scores;
}

}  // namespace topoloc::evaluation

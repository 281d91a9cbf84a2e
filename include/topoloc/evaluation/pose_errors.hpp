// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/evaluation/trajectory.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

/// Absolute pose errors of an estimate against a reference (paper, section VI). The trajectories
/// are never aligned: the map frame is the reference.
namespace topoloc::evaluation {

/// Heading frame of a pose, R_world_heading: x forward (the IMU's x axis seen from above), y to the
/// left, z up (the world's z axis).
Eigen::Matrix3d heading_axes(const Eigen::Matrix3d& R_world_imu);

/// Error of the estimate at one reference stamp.
struct PoseError {
  std::int64_t time_ns = 0;
  RigidTransform T_world_reference;  ///< true pose of the IMU
  RigidTransform T_world_estimate;   ///< estimated pose, interpolated to the stamp
  /// Estimate minus truth in the true heading frame: longitudinal, lateral, vertical [m].
  Eigen::Vector3d heading_error_m = Eigen::Vector3d::Zero();
  /// Log(R_true^T R_estimate), in IMU axes [rad].
  Eigen::Vector3d rotation_error_rad = Eigen::Vector3d::Zero();
  double forward_speed_mps = 0.0;  ///< of the reference along its heading

  [[nodiscard]] double position_m() const { return heading_error_m.norm(); }
  [[nodiscard]] double rotation_rad() const { return rotation_error_rad.norm(); }
};

struct MatchOptions {
  /// Reference poses count from this many seconds after the reference begins: the time that a
  /// localiser may take to start and to settle.
  double from_s = 0.0;
  /// The estimate is not interpolated across a longer gap.
  std::int64_t max_gap_ns = 200'000'000;
};

struct MatchedErrors {
  std::vector<PoseError> errors;
  std::int64_t begin_ns = 0;        ///< first stamp that counts
  std::size_t reference_poses = 0;  ///< reference poses from there to the end of the reference
};

/// Errors at all reference stamps that the estimate covers. An estimate that starts late, stops
/// early or has gaps matches fewer of them.
/// Throws std::runtime_error if no reference pose is left to judge or none is matched, and
/// std::invalid_argument if from_s is negative or not finite.
MatchedErrors match_errors(const Trajectory& reference, const Trajectory& estimate,
                           const MatchOptions& options = {});

/// Of magnitudes (for the mean of signed errors see PoseScores).
struct Statistics {
  double mean = 0.0;
  double rmse = 0.0;
  double median = 0.0;
  double p95 = 0.0;
  double max = 0.0;
};

/// Statistics of |values|; quantiles are interpolated between order statistics. At least one value.
Statistics statistics(const std::vector<double>& values);

struct PoseScores {
  Statistics position_m;    ///< mean = APEt: ||p - p_true||
  Statistics rotation_rad;  ///< mean = APEr: arccos(0.5 (trace(R_true^T R) - 1))
  Statistics longitudinal_m;
  Statistics lateral_m;
  Statistics vertical_m;
  /// Means with sign; positive: the estimate is ahead of, to the left of, above the truth.
  Eigen::Vector3d signed_mean_m = Eigen::Vector3d::Zero();
  /// The time shift that explains the longitudinal errors best (least squares of longitudinal
  /// error over speed): positive if the estimate shows where the vehicle will be that much later.
  /// Nothing if the vehicle hardly moves.
  std::optional<double> time_offset_s;
  /// Drift of dead reckoning: horizontal errors beside the way travelled, along the reference from
  /// the first to the last matched stamp.
  double max_horizontal_m = 0.0;
  double final_horizontal_m = 0.0;
  double travelled_m = 0.0;
  std::size_t matched = 0;
  std::size_t reference_poses = 0;
  double coverage = 0.0;  ///< matched / reference_poses
};

PoseScores score(const MatchedErrors& matched);

}  // namespace topoloc::evaluation

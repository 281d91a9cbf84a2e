// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/refinement/ground.hpp"
#include "topoloc/refinement/registration.hpp"
#include "topoloc/refinement/surface_track.hpp"

#include <cstddef>
#include <vector>

namespace topoloc::refinement {

/// Motion from one keyframe to the next as odometry has it; deviations (theta, t) in the axes of
/// the second.
struct OdometryFactor {
  std::size_t from, to;
  RigidTransform T_from_to;
  double seconds;  ///< that it took: a constant error of the rates turns it by so much
  Vector6 std;
};

/// Which way is up, as inertial dead reckoning has it. A constant error of the specific force tilts
/// it.
struct GravityFactor {
  std::size_t keyframe;
  Eigen::Vector3d up_imu;  ///< the world's z axis in the vehicle's axes
  double std_rad;
};

/// The road below a keyframe: a vehicle keeps its height above it, the same all along the drive.
struct GroundFactor {
  std::size_t keyframe;
  Ground ground;
  double std_m;
};

/// A pose as the trajectory given has it; deviations (theta, t) in its own axes.
struct PriorFactor {
  std::size_t keyframe;
  RigidTransform T_world_imu;
  Vector6 std;
};

/// Points tracked from one keyframe into another, held by the surfaces of the cloud.
struct TrackFactor {
  std::size_t from, to;
  std::vector<SurfaceTrack> tracks;
  std::size_t behind = 0;  ///< points left out, for they lie far behind their surface
};

/// What is known about the poses of a drive's keyframes.
struct PoseGraph {
  std::vector<OdometryFactor> odometry;
  // Constant over the drive; 0: there is no such error.
  double rate_error_std_radps = 0.005;  ///< per axis: gyro bias
  double gyro_scale_std = 0.0;          ///< scale and axes of the gyro, share of what it turns
  double turn_error_std_rad = 0.001;    ///< per axis: the IMU's axes against the way it moves
  double scale_error_std = 0.005;       ///< of the way: the wheels' circumference
  double force_error_std_mps2 = 0.1;    ///< the same of the specific force: tilts all `gravity`
  std::vector<GravityFactor> gravity;
  std::vector<GroundFactor> ground;
  std::vector<PriorFactor> priors;
  std::vector<TrackFactor> tracks;
  std::vector<Registration> registrations;
};

struct SolverConfig {
  int max_iterations = 25;
  /// Tracks share errors (timing, surfaces) between two keyframes and with the pairs around them,
  /// as far as the cloud's own errors reach: together they weigh no more than so many independent
  /// ones a pair.
  double tracks_per_pair = 0.05;
  double track_loss = 2.0;  ///< Cauchy scale of a track's residual, in deviations
  /// Huber threshold of a registration: chance finds are gone already, and a true one may be far
  /// from where the poses begin.
  double registration_loss = 3.0;
  double ground_loss = 2.0;  ///< Huber threshold of the height above ground
  double prior_loss = 3.0;   ///< Cauchy scale of a prior
};

/// Moves poses[first...] to where they fit the graph best; earlier ones stay. Factors that touch no
/// moved pose are left out. Deterministic.
void solve(const PoseGraph& graph, const RigidTransform& T_imu_cam, const PinholeCamera& camera,
           std::size_t first, const SolverConfig& config, std::vector<RigidTransform>& poses);

/// Covariances (theta, t) of all poses given the whole graph.
std::vector<Matrix6> covariances(const PoseGraph& graph, const RigidTransform& T_imu_cam,
                                 const PinholeCamera& camera, const SolverConfig& config,
                                 const std::vector<RigidTransform>& poses);

/// Residual of each track (norm, in pixels) at the given poses.
std::vector<double> track_residuals_px(const TrackFactor& factor, const RigidTransform& T_imu_cam,
                                       const PinholeCamera& camera,
                                       const std::vector<RigidTransform>& poses);

}  // namespace topoloc::refinement

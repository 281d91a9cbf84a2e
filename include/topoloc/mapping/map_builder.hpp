// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/config/vehicle_config.hpp"
#include "topoloc/mapping/lift.hpp"
#include "topoloc/mapping/node_reject.hpp"
#include "topoloc/mapping/node_selection.hpp"
#include "topoloc/mapping/point_cloud.hpp"
#include "topoloc/mapping/pose_refiner.hpp"
#include "topoloc/mapping/render.hpp"
#include "topoloc/transport/lcm_log.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

namespace topoloc::mapping {

/// What a map is made from, and where it goes.
struct BuildPaths {
  std::filesystem::path drive;  ///< folder with camera.lcm and vehicle.yaml
  std::filesystem::path cloud;  ///< .pcd, .ply, .las or .laz, in the world frame
  /// TUM, T_world_imu of the mapping drive; may be empty if a PoseRefiner needs none.
  std::filesystem::path trajectory;
  std::filesystem::path out;  ///< the map file
};

/// Settings of the builder. Feature model, matching camera and mask come from vehicle.yaml.
struct BuildConfig {
  SelectionConfig selection{.frames = FrameParity::kAll};
  RenderConfig render;
  LiftConfig lift;
  /// Standard deviation per axis of the trajectory's poses against the cloud: becomes the
  /// covariance of every node where the poses are taken as they are.
  double trajectory_std_m = 0.02;
  double trajectory_std_rad = 0.05 * std::numbers::pi / 180.0;
  double min_coverage = 0.005;  ///< share of pixels that must show the cloud
  int min_features = 50;
  int min_lifted = 40;  ///< fewer 3D points do not carry a pose
  int threads = 0;      ///< workers; 0: one per usable CPU. Does not change the map
  /// Memory for reading, sorting and using the cloud; what does not fit goes to a nameless scratch
  /// file in the map's folder (CloudStorage). Does not change the map.
  std::uint64_t cloud_memory_bytes = std::uint64_t{1024} << 20U;
  /// Refined poses that an interrupted build has left are taken over; else they are found anew.
  bool take_over_poses = true;
  std::string creator;  ///< program and version, goes into the map
};

struct RejectedNode {
  std::size_t frame = 0;
  std::int64_t time_ns = 0;
  NodeReject reason = NodeReject::kUndecodableImage;
};

struct BuildReport {
  std::size_t frames = 0;  ///< usable ones in camera.lcm
  /// Unusable ones by drive::FrameReject; reasons that did not occur are left out.
  std::map<std::string, std::uint64_t> frames_rejected;
  std::string first_frame_error;    ///< in words; empty if there was none
  transport::LogDamage log_damage;  ///< of camera.lcm
  Selection selection;
  std::size_t keyframes = 0;   ///< frames that refinement looked at; the others have no pose then
  bool poses_resumed = false;  ///< refined poses were taken over from an interrupted run
  std::vector<RejectedNode> rejected_nodes;
  std::size_t nodes_written = 0;
  std::size_t nodes_resumed = 0;  ///< taken over from an interrupted run
  std::size_t nodes_made = 0;     ///< by this one, rejected ones among them
  std::uint64_t features = 0;
  std::uint64_t lifted = 0;
  std::uint64_t contradicted = 0;  ///< by the neighbouring nodes' images: their depth is not used
  double mean_depth_std_m = 0.0;   ///< over the lifted features
  std::uint64_t map_bytes = 0;
  std::uint64_t cloud_points = 0;
  std::uint64_t cloud_points_rejected = 0;
  double cloud_spacing_m = 0.0;  ///< median distance of neighbouring points
  bool cloud_on_disk = false;    ///< it did not fit into cloud_memory_bytes
  double cloud_seconds = 0.0;    ///< loading and sorting
  double poses_seconds = 0.0;    ///< wall clock of refinement
  double nodes_seconds = 0.0;    ///< wall clock of all nodes
  double depths_seconds = 0.0;   ///< of holding their depths against each other's images
};

/// Called from worker threads, one at a time.
struct BuildProgress {
  Progress cloud;
  Progress poses;  ///< refinement
  Progress nodes;
  Progress depths;  ///< held against the neighbouring nodes' images
};

/// Builds a map from a cloud and a drive (method parts M1, M3, M7): at the poses of the trajectory,
/// or at those that `refiner` finds.
///
/// Refined poses, once all are found, and finished nodes are kept in `<out>.partial/` until the map
/// is complete: a build that was killed goes on where it stopped if inputs and settings are the
/// same, and gives the same file as one that was not. The map does not depend on the number of
/// threads.
///
/// Throws std::runtime_error (or an exception derived from it) that names file and reason: unusable
/// inputs, a trajectory that covers no frame, a cloud that lies elsewhere than the drive, no node
/// good enough.
BuildReport build_map(const BuildPaths& paths, const BuildConfig& config,
                      const BuildProgress& progress = {}, PoseRefiner* refiner = nullptr);

}  // namespace topoloc::mapping

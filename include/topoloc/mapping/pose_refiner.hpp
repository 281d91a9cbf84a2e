// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/drive/frame_log.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/mapping/cloud_grid.hpp"
#include "topoloc/mapping/map_report.hpp"
#include "topoloc/mapping/node_reject.hpp"
#include "topoloc/mapping/point_cloud.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace topoloc::mapping {

/// A frame whose pose in the cloud has been looked for.
struct RefinedPose {
  std::size_t frame = 0;  ///< order number in the camera log
  std::int64_t time_ns = 0;
  RigidTransform T_world_imu;
  /// Of the error (theta [rad], t [m]) in the vehicle's own axes: R_true = R Exp(theta),
  /// p_true = p + R t.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::optional<NodeReject> rejected;  ///< why no node may be made of it
  /// What the verdict rests on, by name with unit ("pose_std_m", "track_residual_px"): goes into
  /// the map.
  Figures figures;
};

/// Finds the poses of a drive's frames in a cloud.
class PoseRefiner {
 public:
  virtual ~PoseRefiner() = default;
  /// What the map says of how its poses were found.
  [[nodiscard]] virtual std::string name() const = 0;
  /// What the poses depend on besides cloud, drive and files(), as text: with the same they are the
  /// same.
  [[nodiscard]] virtual std::string settings() const = 0;
  /// Files that it uses besides, such as networks.
  [[nodiscard]] virtual std::vector<std::filesystem::path> files() const { return {}; }
  /// In time order. Throws std::runtime_error where drive and cloud do not belong together.
  virtual std::vector<RefinedPose> refine(const CloudGrid& grid, drive::FrameLog& frames,
                                          const Progress& progress) = 0;
};

}  // namespace topoloc::mapping

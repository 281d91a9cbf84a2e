// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

/// Offline map building. Never linked into the vehicle process.
namespace topoloc::mapping {

/// Called now and then with the share of the work that is done, 0 to 1. May be empty.
using Progress = std::function<void(double fraction)>;

/// Points beyond this distance from the cloud's origin are rejected: float32 would no longer hold
/// them to a centimetre, and in practice they are garbage.
inline constexpr double kMaxExtent_m = 100'000.0;

/// What is known of a cloud besides its points.
struct CloudInfo {
  /// World position of the zero of the points' coordinates: the first point, rounded to whole
  /// metres.
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  bool has_intensity = false;
  std::string crs;  ///< coordinate reference system (OGC WKT, or "EPSG:n"); empty if not stated

  std::uint64_t rejected_not_finite = 0;  ///< NaN or infinite coordinates
  std::uint64_t rejected_too_far = 0;     ///< beyond kMaxExtent_m
  std::uint64_t rejected_noise = 0;       ///< LAS: withheld, or classified as noise (7, 18)

  [[nodiscard]] std::uint64_t rejected() const {
    return rejected_not_finite + rejected_too_far + rejected_noise;
  }
};

/// A LiDAR map in memory, in the order of its file. 16 bytes per point: float32 positions around a
/// double origin.
struct PointCloud : CloudInfo {
  std::vector<Eigen::Vector3f> positions_m;  ///< relative to origin_m, axes of the world
  std::vector<float> intensities;  ///< in the file's own units; all 0 if the file has none

  [[nodiscard]] std::size_t size() const { return positions_m.size(); }
  /// World position [m] of a point.
  [[nodiscard]] Eigen::Vector3d position_world(std::size_t i) const {
    return origin_m + positions_m[i].cast<double>();
  }
};

/// Reads a whole point cloud into memory (CloudGrid::load needs no more than it is given), format
/// by file name extension: .pcd (ascii, binary, binary_compressed), .ply (ascii, binary of either
/// byte order), .las and .laz.
///
/// Needs coordinates x, y, z; takes the intensity where there is one (`intensity`,
/// `scalar_Intensity` or `reflectance`, upper or lower case, in PCD and PLY).
/// Throws std::runtime_error with the file's name and what is wrong: missing, truncated or empty
/// file, unknown format, a point count the file cannot hold, no usable point.
PointCloud load_point_cloud(const std::filesystem::path& path, const Progress& progress = {});

}  // namespace topoloc::mapping

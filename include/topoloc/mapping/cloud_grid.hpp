// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/mapping/point_cloud.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Geometry>

namespace topoloc::mapping {

/// How much memory a cloud may take, and where the rest of it goes.
struct CloudStorage {
  /// Peak of sorting, and of the cloud's pages held while it is used (beyond that: some 4 MB while
  /// reading, and what one view of each thread looks at). A cloud that needs more, at 36 bytes a
  /// point, is sorted on disk and used from there. Below 64 MB, merging the sorted parts of a very
  /// large cloud may take more: 4 KiB a part.
  std::uint64_t memory_bytes = std::numeric_limits<std::uint64_t>::max();
  /// Folder of the scratch file: 16 bytes a point (twice that where the file system cannot give
  /// back parts of a file). The file has no name and is gone with the CloudGrid. A folder in
  /// memory (tmpfs) would defeat its purpose.
  std::filesystem::path scratch_folder = ".";
};

struct SortedPoints;

/// The points of a CloudGrid, cell by cell, in memory or mapped from disk. (Mapped pages are held
/// within bounds for those who ask cells_in_view() what to read; reading all of a large cloud past
/// it fills the memory that is free.)
struct SortedCloud : CloudInfo {
  std::span<const Eigen::Vector3f> positions_m;  ///< relative to origin_m, axes of the world
  std::span<const float> intensities;            ///< in the file's own units
  Eigen::AlignedBox3d box_world;                 ///< [m] around all points

  [[nodiscard]] std::size_t size() const { return positions_m.size(); }
  /// World position [m] of a point.
  [[nodiscard]] Eigen::Vector3d position_world(std::size_t i) const {
    return origin_m + positions_m[i].cast<double>();
  }
};

/// A point cloud sorted into cubic cells, so that one view costs what it sees, however large the
/// map is. May be read from many threads at once.
class CloudGrid {
 public:
  static constexpr double kCellSize_m = 8.0;

  /// Points [begin, end) of cloud() lie in one cell.
  struct Cell {
    std::int32_t x, y, z;  ///< floor(position / cell size), relative to the cloud's origin
    std::uint32_t begin, end;
  };

  /// Sorts the points cell by cell; within a cell they keep their order. The result does not
  /// depend on `storage`.
  /// Throws std::invalid_argument on positions beyond kMaxExtent_m or NaN, std::length_error on
  /// more than 2^32 - 2 points, std::runtime_error if the scratch file cannot be written.
  explicit CloudGrid(PointCloud cloud, const CloudStorage& storage = {});

  /// The same for a file (formats and errors as for load_point_cloud()), read point by point.
  static CloudGrid load(const std::filesystem::path& path, const CloudStorage& storage,
                        const Progress& progress = {});

  CloudGrid(CloudGrid&&) noexcept;
  CloudGrid& operator=(CloudGrid&&) noexcept;
  ~CloudGrid();

  [[nodiscard]] const SortedCloud& cloud() const { return cloud_; }
  [[nodiscard]] std::span<const Cell> cells() const;

  /// Cells that may hold a point with 0 < Z < max_depth_m inside the image; in fixed order.
  [[nodiscard]] std::vector<Cell> cells_in_view(const PinholeCamera& camera,
                                                const RigidTransform& T_world_cam,
                                                double max_depth_m) const;

  /// Median distance [m] from a point to the nearest other one, over a few hundred points spread
  /// evenly over the cloud; 0 if no two points share a cell.
  [[nodiscard]] double median_spacing_m() const;

  /// Sorted parts that were written to disk; 0: the cloud is kept in memory.
  [[nodiscard]] std::size_t spilled_runs() const;
  /// Most memory that sorting held at a time.
  [[nodiscard]] std::uint64_t peak_bytes() const;

 private:
  CloudGrid(CloudInfo info, SortedPoints points);
  /// Before points are read, to keep the pages held bounded.
  void about_to_read(std::uint64_t points) const;

  std::unique_ptr<const SortedPoints> points_;
  SortedCloud cloud_;
};

}  // namespace topoloc::mapping

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/point_cloud.hpp"

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

/// What the readers of the point-cloud formats share. (PCL reads PCD and PLY too, but brings 433
/// packages along; these two formats are a page each.)
namespace topoloc::mapping {

PointCloud read_pcd(const std::filesystem::path& path, const Progress& progress);
PointCloud read_ply(const std::filesystem::path& path, const Progress& progress);
PointCloud read_las(const std::filesystem::path& path, const Progress& progress);

/// Error with the file's name in front.
[[noreturn]] inline void fail(const std::filesystem::path& path, const std::string& what) {
  throw std::runtime_error(path.string() + ": " + what);
}

/// Fills a cloud point by point: fixes the origin, counts what it rejects.
class PointSink {
 public:
  /// `expected` points are reserved; the caller has checked that the file can hold that many.
  PointSink(bool has_intensity, std::uint64_t expected) {
    cloud_.has_intensity = has_intensity;
    cloud_.positions_m.reserve(expected);
    cloud_.intensities.reserve(expected);
  }
  /// World coordinates [m]; intensity in the file's units (not finite: taken as 0).
  void add(const Eigen::Vector3d& p_world_m, float intensity);
  PointCloud& cloud() { return cloud_; }

 private:
  PointCloud cloud_;
};

/// Reports progress about a hundred times in `total` steps.
class ProgressTicker {
 public:
  ProgressTicker(const Progress& progress, std::uint64_t total)
      : progress_(progress), total_(total), stride_(total / 100 + 1) {}
  void at(std::uint64_t done) const {
    if (progress_ && done % stride_ == 0) {
      progress_(static_cast<double>(done) / static_cast<double>(total_));
    }
  }

 private:
  const Progress& progress_;
  std::uint64_t total_;
  std::uint64_t stride_;
};

}  // namespace topoloc::mapping

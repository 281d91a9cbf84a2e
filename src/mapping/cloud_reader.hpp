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

/// Error with the file's name in front.
[[noreturn]] inline void fail(const std::filesystem::path& path, const std::string& what) {
  throw std::runtime_error(path.string() + ": " + what);
}

/// Takes a cloud point by point: fixes the origin, counts what it rejects. What becomes of the
/// points is up to the derived class.
class PointSink {
 public:
  PointSink() = default;
  virtual ~PointSink() = default;
  PointSink(const PointSink&) = delete;
  PointSink& operator=(const PointSink&) = delete;

  /// The number of points to come at most, before the first one; the reader has checked that the
  /// file can hold that many.
  virtual void expect(std::uint64_t points) = 0;
  /// World coordinates [m]; intensity in the file's units (not finite: taken as 0).
  void add(const Eigen::Vector3d& p_world_m, float intensity);
  CloudInfo& info() { return info_; }
  /// Points that were not rejected.
  [[nodiscard]] std::uint64_t taken() const { return taken_; }

 protected:
  /// Position relative to info().origin_m.
  virtual void take(const Eigen::Vector3f& position_m, float intensity) = 0;

 private:
  CloudInfo info_;
  std::uint64_t taken_ = 0;
};

// Each reads a file into a sink, and needs no memory that grows with the file.
void read_pcd(const std::filesystem::path& path, PointSink& sink, const Progress& progress);
void read_ply(const std::filesystem::path& path, PointSink& sink, const Progress& progress);
void read_las(const std::filesystem::path& path, PointSink& sink, const Progress& progress);

/// The reader of the file's format; checks that the sink got points.
void read_points(const std::filesystem::path& path, PointSink& sink, const Progress& progress);

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

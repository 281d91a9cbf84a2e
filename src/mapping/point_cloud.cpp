// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/point_cloud.hpp"

#include "mapping/cloud_reader.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

namespace topoloc::mapping {

namespace {

/// Keeps everything in memory.
class CollectingSink : public PointSink {
 public:
  void expect(std::uint64_t points) override {
    // A compressed file may announce far more than it holds: beyond this, the vectors grow.
    constexpr std::uint64_t kMaxReserved = 100'000'000;
    cloud_.positions_m.reserve(std::min(points, kMaxReserved));
    cloud_.intensities.reserve(std::min(points, kMaxReserved));
  }
  PointCloud finish() {
    static_cast<CloudInfo&>(cloud_) = std::move(info());
    return std::move(cloud_);
  }

 protected:
  void take(const Eigen::Vector3f& position_m, float intensity) override {
    cloud_.positions_m.push_back(position_m);
    cloud_.intensities.push_back(intensity);
  }

 private:
  PointCloud cloud_;
};

}  // namespace

void PointSink::add(const Eigen::Vector3d& p_world_m, float intensity) {
  if (!p_world_m.allFinite()) {
    ++info_.rejected_not_finite;
    return;
  }
  if (taken_ == 0) {
    // Rounding a number that large changes nothing, but keeps the arithmetic finite below.
    info_.origin_m = p_world_m.array().round();
  }
  const Eigen::Vector3d offset_m = p_world_m - info_.origin_m;
  if (offset_m.lpNorm<Eigen::Infinity>() > kMaxExtent_m) {
    ++info_.rejected_too_far;
    return;
  }
  ++taken_;
  take(offset_m.cast<float>(), std::isfinite(intensity) ? intensity : 0.0F);
}

void read_points(const std::filesystem::path& path, PointSink& sink, const Progress& progress) {
  if (!std::filesystem::is_regular_file(path)) {
    fail(path, "no such point cloud file");
  }
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".pcd") {
    read_pcd(path, sink, progress);
  } else if (extension == ".ply") {
    read_ply(path, sink, progress);
  } else if (extension == ".las" || extension == ".laz") {
    read_las(path, sink, progress);
  } else {
    fail(path, "unknown point cloud format '" + extension + "' (known: .pcd .ply .las .laz)");
  }
  const CloudInfo& info = sink.info();
  const std::string reasons = std::to_string(info.rejected_not_finite) + " not finite, " +
                              std::to_string(info.rejected_too_far) + " too far off, " +
                              std::to_string(info.rejected_noise) + " noise";
  if (sink.taken() == 0) {
    fail(path, info.rejected() == 0 ? "holds no point" : "holds no usable point (" + reasons + ")");
  }
  if (info.rejected_too_far > sink.taken()) {
    // The origin is the first point: if most points are far from it, the first one is the stray.
    fail(path, "most points lie more than 100 km from the first one (" + reasons +
                   "): remove the stray points first");
  }
  if (progress) {
    progress(1.0);
  }
}

PointCloud load_point_cloud(const std::filesystem::path& path, const Progress& progress) {
  CollectingSink sink;
  read_points(path, sink, progress);
  return sink.finish();
}

}  // namespace topoloc::mapping

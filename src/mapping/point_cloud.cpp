// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/point_cloud.hpp"

#include "mapping/cloud_reader.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

namespace topoloc::mapping {

void PointSink::add(const Eigen::Vector3d& p_world_m, float intensity) {
  if (!p_world_m.allFinite()) {
    ++cloud_.rejected_not_finite;
    return;
  }
  if (cloud_.positions_m.empty()) {
    // Rounding a number that large changes nothing, but keeps the arithmetic finite below.
    cloud_.origin_m = p_world_m.array().round();
  }
  const Eigen::Vector3d offset_m = p_world_m - cloud_.origin_m;
  if (offset_m.lpNorm<Eigen::Infinity>() > kMaxExtent_m) {
    ++cloud_.rejected_too_far;
    return;
  }
  cloud_.positions_m.emplace_back(offset_m.cast<float>());
  cloud_.intensities.push_back(std::isfinite(intensity) ? intensity : 0.0F);
}

PointCloud load_point_cloud(const std::filesystem::path& path, const Progress& progress) {
  if (!std::filesystem::is_regular_file(path)) {
    fail(path, "no such point cloud file");
  }
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  PointCloud cloud;
  if (extension == ".pcd") {
    cloud = read_pcd(path, progress);
  } else if (extension == ".ply") {
    cloud = read_ply(path, progress);
  } else if (extension == ".las" || extension == ".laz") {
    cloud = read_las(path, progress);
  } else {
    fail(path, "unknown point cloud format '" + extension + "' (known: .pcd .ply .las .laz)");
  }
  const std::uint64_t rejected =
      cloud.rejected_not_finite + cloud.rejected_too_far + cloud.rejected_noise;
  const std::string reasons = std::to_string(cloud.rejected_not_finite) + " not finite, " +
                              std::to_string(cloud.rejected_too_far) + " too far off, " +
                              std::to_string(cloud.rejected_noise) + " noise";
  if (cloud.size() == 0) {
    fail(path, rejected == 0 ? "holds no point" : "holds no usable point (" + reasons + ")");
  }
  if (cloud.rejected_too_far > cloud.size()) {
    // The origin is the first point: if most points are far from it, the first one is the stray.
    fail(path, "most points lie more than 100 km from the first one (" + reasons +
                   "): remove the stray points first");
  }
  if (progress) {
    progress(1.0);
  }
  return cloud;
}

}  // namespace topoloc::mapping

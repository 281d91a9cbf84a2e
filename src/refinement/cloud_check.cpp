// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/cloud_check.hpp"

#include "topoloc/mapping/cloud_cover.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/core.h>

namespace topoloc::refinement {
namespace {

constexpr const char* kInstead = "give a trajectory that fits the cloud and --refine none";

}  // namespace

void check_cloud(const mapping::CloudGrid& grid, const PinholeCamera& camera,
                 const RigidTransform& T_imu_cam, std::span<const RigidTransform> T_world_imu,
                 double max_depth_m) {
  const mapping::SortedCloud& cloud = grid.cloud();
  if (!cloud.has_intensity) {
    throw std::runtime_error(fmt::format(
        "refinement: the cloud has no intensities to compare the camera images with; {}",
        kInstead));
  }
  const float first = cloud.intensities.front();
  // Of a usable cloud this ends with its first points.
  if (std::all_of(cloud.intensities.begin(), cloud.intensities.end(),
                  [first](float intensity) { return intensity == first; })) {
    throw std::runtime_error(
        fmt::format("refinement: all points of the cloud have the same intensity, {}: that is "
                    "nothing to compare the camera images with; {}",
                    first, kInstead));
  }
  const mapping::CloudCover cover =
      mapping::cloud_cover(grid, camera, T_imu_cam, T_world_imu, max_depth_m);
  if (cover.lies_elsewhere()) {
    throw std::runtime_error("refinement: " + cover.complaint());
  }
}

}  // namespace topoloc::refinement

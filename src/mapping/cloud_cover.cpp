// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/mapping/cloud_cover.hpp"

#include <sstream>

namespace topoloc::mapping {
namespace {

std::string box_text(const Eigen::AlignedBox3d& box) {
  std::ostringstream text;
  text.setf(std::ios::fixed);
  text.precision(1);
  text << "x " << box.min().x() << " to " << box.max().x() << ", y " << box.min().y() << " to "
       << box.max().y() << ", z " << box.min().z() << " to " << box.max().z() << " m";
  return text.str();
}

}  // namespace

std::string CloudCover::complaint() const {
  return "the cloud lies elsewhere than the drive: " + std::to_string(blind) + " of " +
         std::to_string(poses) + " poses see none of it. Cloud: " + box_text(cloud_world) +
         "; drive: " + box_text(drive_world) +
         ". Are the poses given in the frame of this cloud (origin, axes, order of coordinates)?";
}

CloudCover cloud_cover(const CloudGrid& grid, const PinholeCamera& camera,
                       const RigidTransform& T_imu_cam, std::span<const RigidTransform> T_world_imu,
                       double max_depth_m) {
  CloudCover cover;
  cover.cloud_world = grid.cloud().box_world;
  for (const RigidTransform& pose : T_world_imu) {
    ++cover.poses;
    cover.blind += grid.cells_in_view(camera, pose * T_imu_cam, max_depth_m).empty() ? 1 : 0;
    cover.drive_world.extend(pose.p);
  }
  return cover;
}

}  // namespace topoloc::mapping

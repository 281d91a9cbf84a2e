// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/match_route.hpp"

#include "refinement/matcher_image.hpp"

namespace topoloc::refinement {

PinholeCamera resized(const PinholeCamera& camera, const cv::Size& size) {
  const double scale = static_cast<double>(size.width) / camera.width_px;
  return {size.width,
          size.height,
          scale * camera.fx_px,
          scale * camera.fy_px,
          0.5 * (size.width - 1),
          0.5 * (size.height - 1)};
}

MatchRoute::MatchRoute(const drive::Drive& drive, const mapping::CloudGrid& grid,
                       matching::ImagePairMatcher& matcher, const RefinementConfig& config)
    : grid_(grid),
      matcher_(matcher),
      config_(config),
      camera_(resized(matching::matching_camera(drive.vehicle.matching), matcher.input_size())),
      T_imu_cam_(drive.vehicle.camera.kalibr.T_imu_cam),
      undistorter_(drive.vehicle.camera.kalibr.calibration, camera_),
      mask_(undistorter_.mask(drive::read_mask(drive.vehicle.camera),
                              drive.vehicle.matching.mask_erosion_px)) {}

MatchRoute::Pair MatchRoute::prepare(const cv::Mat& raw, const RigidTransform& T_world_imu) const {
  Pair pair{T_world_imu, {{}, mask_}, {}, {}};
  undistorter_.undistort(raw, pair.camera.grey);
  const RigidTransform T_world_cam = T_world_imu * T_imu_cam_;
  pair.view = mapping::render(grid_, camera_, T_world_cam, config_.render);
  mapping::average_intensity(grid_, T_world_cam, config_.render, pair.view);
  pair.cloud = matcher_image(pair.view);
  return pair;
}

Registration MatchRoute::registered(const Pair& pair, const Vector6& std) {
  matcher_.match(pair.cloud, pair.camera, matches_);
  return register_by_matches(matches_, pair.view, {pair.T_world_imu, std}, T_imu_cam_, config_.lift,
                             config_.match);
}

}  // namespace topoloc::refinement

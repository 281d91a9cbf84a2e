// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/drive/drive.hpp"
#include "topoloc/mapping/cloud_grid.hpp"
#include "topoloc/matching/image_pair_matcher.hpp"
#include "topoloc/matching/undistorter.hpp"
#include "topoloc/refinement/match_registration.hpp"
#include "topoloc/refinement/trajectory_refiner.hpp"

namespace topoloc::refinement {

/// A camera of the same view in images of another size: by their widths, principal point in the
/// middle.
PinholeCamera resized(const PinholeCamera& camera, const cv::Size& size);

/// Route (a) on one drive: images as the matcher takes them, and what it makes of them.
class MatchRoute {
 public:
  /// Camera image and rendered cloud, both of the matcher's input size.
  struct Pair {
    RigidTransform T_world_imu;  ///< that the cloud is rendered from
    matching::MaskedImage camera;
    matching::MaskedImage cloud;
    mapping::RenderedView view;
  };

  /// All must outlive this.
  MatchRoute(const drive::Drive& drive, const mapping::CloudGrid& grid,
             matching::ImagePairMatcher& matcher, const RefinementConfig& config);

  /// `raw`: as the camera gave it. May be called from many threads at once.
  [[nodiscard]] Pair prepare(const cv::Mat& raw, const RigidTransform& T_world_imu) const;
  /// `std`: what the pair's pose may be off by. One thread at a time.
  Registration registered(const Pair& pair, const Vector6& std);

 private:
  const mapping::CloudGrid& grid_;
  matching::ImagePairMatcher& matcher_;
  const RefinementConfig& config_;
  PinholeCamera camera_;
  RigidTransform T_imu_cam_;
  matching::Undistorter undistorter_;
  cv::Mat mask_;
  std::vector<matching::PixelMatch> matches_;
};

}  // namespace topoloc::refinement

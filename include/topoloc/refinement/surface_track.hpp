// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/mapping/lift.hpp"
#include "topoloc/mapping/render.hpp"

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace topoloc::refinement {

/// A corner of an image that lies on a surface of the cloud.
struct SurfacePoint {
  Eigen::Vector2d pixel_px;
  double depth_m;
  double depth_std_m;
  /// The surface in the world, plane.head<3>() . x = plane(3): it stays where it is when the pose
  /// of the camera is found to be another, and the point slides along it. A point that moved with
  /// the camera would take a camera's place off to the side for a turn.
  Eigen::Vector4d plane_world;
};

/// The same point in two images.
struct SurfaceTrack {
  SurfacePoint from;      ///< in the first image
  Eigen::Vector2d to_px;  ///< in the second
  double std_px = 1.0;    ///< of to_px, per axis: tracking, and what the depth is uncertain by
};

/// Where a ray meets a plane; the caller makes sure that it does.
template <typename Scalar>
Eigen::Matrix<Scalar, 3, 1> meet(const Eigen::Matrix<Scalar, 3, 1>& origin,
                                 const Eigen::Matrix<Scalar, 3, 1>& direction,
                                 const Eigen::Vector4d& plane) {
  const Eigen::Matrix<Scalar, 3, 1> normal = plane.head<3>().cast<Scalar>();
  const Scalar along = (Scalar(plane(3)) - normal.dot(origin)) / normal.dot(direction);
  return origin + along * direction;
}

/// What comes of following points from one image into another.
struct FollowedPoints {
  std::vector<SurfaceTrack> tracks;
  std::size_t behind = 0;  ///< points followed, but left out: they lie far behind their surface
};

struct TrackConfig {
  int max_corners = 500;          ///< looked for in an image
  double corner_quality = 0.002;  ///< of the best corner
  double corner_distance_px = 10.0;
  int window_px = 17;  ///< of the tracker; odd
  int pyramid_levels = 3;
  double max_forward_backward_px = 0.5;
  /// Points of surfaces whose normal has more than that of the vertical are left out: the flow of
  /// the road hangs on the height above it, and the roads of clouds lie in layers some centimetres
  /// apart. Taken for a rotation, that pitches the vehicle by a degree over 40 m.
  double max_upward = 0.5;
  double pixel_std_px = 0.7;  ///< of a tracked point, per axis
  /// What moves as if it were more than that many times as far from the first camera as the surface
  /// is mirrored in it or seen through it, or moves along with the camera, as the pool of its lamps
  /// does: no point of the cloud. What is nearer stays, for a wrong wheel scale or calibration to
  /// show: wheels that tell 1.2 times the way make everything look 1.2 times as far.
  double max_times_farther = 1.5;
};

/// Corners of an image (CV_8UC1; none where `mask` is 0) on surfaces that the rendered cloud shows.
std::vector<SurfacePoint> find_surface_points(const cv::Mat& grey, const cv::Mat& mask,
                                              const mapping::RenderedView& view,
                                              const RigidTransform& T_world_cam,
                                              const mapping::LiftConfig& lift,
                                              const TrackConfig& config);

/// Follows the first image's points into the second (pyramidal Lucas-Kanade from the predicted
/// place, forth and back).
FollowedPoints track(const cv::Mat& from, const std::vector<SurfacePoint>& points,
                     const cv::Mat& to, const cv::Mat& to_mask, const RigidTransform& T_to_from,
                     const PinholeCamera& camera, const TrackConfig& config);

}  // namespace topoloc::refinement

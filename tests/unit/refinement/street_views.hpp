// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/refinement/view_correlation.hpp"
#include "topoloc/refinement/window_registration.hpp"

#include "unit/refinement/textured_street.hpp"

#include <cstddef>
#include <functional>
#include <vector>

namespace topoloc::refinement {

/// Views of a street from poses that are wrong by one common motion of the whole window.
struct StreetViews {
  std::vector<RigidTransform> truth;
  std::vector<RigidTransform> start;  ///< where the vehicle is thought to have been
  std::vector<ViewCorrelation> correlations;

  static constexpr std::size_t kMiddle = 2;

  [[nodiscard]] std::vector<WindowView> window() const {
    std::vector<WindowView> views;
    for (std::size_t i = 0; i < start.size(); ++i) {
      views.push_back({&correlations[i], start[i]});
    }
    return views;
  }
  [[nodiscard]] Registration registered(const SearchConfig& config = {}) const {
    return register_window(window(), start[kMiddle], TexturedStreet::T_imu_cam(),
                           TexturedStreet::camera(), config);
  }
};

/// What the camera of a vehicle sees from T_world_cam.
using Photograph = std::function<cv::Mat(const RigidTransform& T_world_cam)>;

/// Photos against the cloud of a street. `wrong`: the motion (in the axes of the middle vehicle)
/// from the true poses to those thought.
inline StreetViews look_at_street(const mapping::CloudGrid& cloud, const Photograph& photograph,
                                  const Vector6& wrong, int shrink = 1) {
  constexpr std::size_t kViews = 5;
  constexpr double kStep_m = 2.0;
  StreetViews views;
  for (std::size_t i = 0; i < kViews; ++i) {
    views.truth.push_back(TexturedStreet::vehicle_at(kStep_m * static_cast<double>(i)));
  }
  const RigidTransform& middle = views.truth[StreetViews::kMiddle];
  const RigidTransform motion = moved(middle, wrong) * middle.inverse();
  const PinholeCamera camera = TexturedStreet::camera();
  const cv::Mat mask(camera.height_px, camera.width_px, CV_8UC1, cv::Scalar(255));
  for (const RigidTransform& T_world_imu : views.truth) {
    views.start.push_back(motion * T_world_imu);
    const RigidTransform T_world_cam = views.start.back() * TexturedStreet::T_imu_cam();
    const mapping::RenderedView view = mapping::render(cloud, camera, T_world_cam);
    const cv::Mat photo = photograph(T_world_imu * TexturedStreet::T_imu_cam());
    views.correlations.push_back(correlate(camera_gradients(photo, mask, {}),
                                           intensity_gradients(view, {}), view, T_world_cam, shrink,
                                           {}));
  }
  return views;
}

/// The same of a street as it is.
inline StreetViews look_at_street(const mapping::CloudGrid& cloud, const TexturedStreet& street,
                                  const Vector6& wrong, int shrink = 1) {
  return look_at_street(
      cloud, [&](const RigidTransform& T_world_cam) { return street.photo(T_world_cam); }, wrong,
      shrink);
}

}  // namespace topoloc::refinement

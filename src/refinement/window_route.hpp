// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/cloud_grid.hpp"
#include "topoloc/refinement/trajectory_refiner.hpp"
#include "topoloc/refinement/window_registration.hpp"

#include <cstdint>
#include <optional>
#include <span>

namespace topoloc::refinement {

/// Route (b) on one drive: views of the cloud against camera images, registered in windows.
class WindowRoute {
 public:
  /// `camera`, `mask`: of the undistorted images. All references must outlive this.
  WindowRoute(const mapping::CloudGrid& grid, const PinholeCamera& camera,
              const RigidTransform& T_imu_cam, const cv::Mat& mask, const RefinementConfig& config);

  /// Correlates an undistorted image with the view rendered at T_world_cam, at 1 / `shrink` of the
  /// resolution. May be called from many threads at once.
  [[nodiscard]] ViewCorrelation correlated(const cv::Mat& image, mapping::RenderedView view,
                                           const RigidTransform& T_world_cam, int shrink) const;
  /// Searches around T_world_imu, a pose of the window, with `std` (theta, t) and samples drawn
  /// with `seed`.
  [[nodiscard]] Registration registered(std::span<const WindowView> views,
                                        const RigidTransform& T_world_imu, const Vector6& std,
                                        std::uint64_t seed) const;
  /// Adds what a window says about the camera's lens, once its pose was `found`. A wrong lens puts
  /// poses far off: searched with all of `config.search.std`.
  void try_lenses(std::span<const WindowView> views, const RigidTransform& T_world_imu,
                  const RigidTransform& found);
  /// What all these windows say together.
  [[nodiscard]] BestLens lens() const;

 private:
  [[nodiscard]] SearchConfig search(const Vector6& std, std::uint64_t seed) const;

  const mapping::CloudGrid& grid_;
  const PinholeCamera& camera_;
  const RigidTransform& T_imu_cam_;
  const cv::Mat& mask_;
  const RefinementConfig& config_;
  std::optional<LensSweep> sweep_;  // sum over windows
};

}  // namespace topoloc::refinement

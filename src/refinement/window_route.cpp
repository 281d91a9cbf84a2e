// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "refinement/window_route.hpp"

#include <algorithm>

namespace topoloc::refinement {

WindowRoute::WindowRoute(const mapping::CloudGrid& grid, const PinholeCamera& camera,
                         const RigidTransform& T_imu_cam, const cv::Mat& mask,
                         const RefinementConfig& config)
    : grid_(grid), camera_(camera), T_imu_cam_(T_imu_cam), mask_(mask), config_(config) {}

ViewCorrelation WindowRoute::correlated(const cv::Mat& image, mapping::RenderedView view,
                                        const RigidTransform& T_world_cam, int shrink) const {
  mapping::average_intensity(grid_, T_world_cam, config_.render, view);
  return correlate(camera_gradients(image, mask_, config_.gradients),
                   intensity_gradients(view, config_.gradients), view, T_world_cam, shrink,
                   config_.correlation);
}

SearchConfig WindowRoute::search(const Vector6& std, std::uint64_t seed) const {
  SearchConfig search = config_.search;
  search.std = std;
  search.seed = seed;
  search.threads = config_.threads;
  return search;
}

Registration WindowRoute::registered(std::span<const WindowView> views,
                                     const RigidTransform& T_world_imu, const Vector6& std,
                                     std::uint64_t seed) const {
  return register_window(views, T_world_imu, T_imu_cam_, camera_, search(std, seed));
}

void WindowRoute::try_lenses(std::span<const WindowView> views, const RigidTransform& T_world_imu,
                             const RigidTransform& found) {
  const LensSweep sweep = sweep_lens(views, T_world_imu, found, T_imu_cam_, camera_,
                                     search(config_.search.std, config_.search.seed));
  LensSweep& sum = sweep_ ? *sweep_ : sweep_.emplace();
  std::transform(sweep.begin(), sweep.end(), sum.begin(), sum.begin(),
                 [](const LensFit& a, const LensFit& b) {
                   return LensFit{a.agreement + b.agreement, a.scatter + b.scatter};
                 });
}

BestLens WindowRoute::lens() const { return sweep_ ? best_lens(*sweep_) : BestLens{}; }

}  // namespace topoloc::refinement

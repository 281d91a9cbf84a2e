// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/camera_path.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace topoloc::rendering {

CameraPath::CameraPath(const CameraMotion& T_world_cam, double exposure_s, double readout_s) {
  constexpr double kStep_s = 0.0005;
  const double span_s = exposure_s + readout_s;
  const auto steps = static_cast<int>(std::clamp(std::ceil(span_s / kStep_s), 1.0, 200.0));
  begin_s_ = -0.5 * span_s;
  step_s_ = std::max(span_s / steps, 1e-9);
  for (int i = 0; i <= steps; ++i) {
    poses_.push_back(T_world_cam(begin_s_ + i * span_s / steps));
  }
}

// Rotation matrices between two close ones, element by element: wrong by the square of the angle
// between them, far less than a pixel.
RigidTransform CameraPath::at(double since_mid_exposure_s) const {
  const double place = std::max((since_mid_exposure_s - begin_s_) / step_s_, 0.0);
  const std::size_t i = std::min(static_cast<std::size_t>(place), poses_.size() - 2);
  const double share = std::min(place - static_cast<double>(i), 1.0);
  const RigidTransform& a = poses_[i];
  const RigidTransform& b = poses_[i + 1];
  return {a.R + share * (b.R - a.R), a.p + share * (b.p - a.p)};
}

}  // namespace topoloc::rendering

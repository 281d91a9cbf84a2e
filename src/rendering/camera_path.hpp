// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/camera_renderer.hpp"

#include <vector>

namespace topoloc::rendering {

/// Where the camera is during one frame: asked a few times and interpolated, since it takes part in
/// every sample. Times are relative to mid-exposure of the middle row.
class CameraPath {
 public:
  CameraPath(const CameraMotion& T_world_cam, double exposure_s, double readout_s);

  [[nodiscard]] RigidTransform at(double since_mid_exposure_s) const;

 private:
  double begin_s_ = 0.0;
  double step_s_ = 1.0;
  std::vector<RigidTransform> poses_;
};

}  // namespace topoloc::rendering

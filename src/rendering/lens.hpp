// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"

#include <vector>

#include <Eigen/Core>

namespace topoloc::rendering {

/// Rays of a lens, looked up: the model is undone by iteration, too slow for every sample.
class Lens {
 public:
  Lens(const CameraCalibration& calibration, int threads);

  /// Point at Z = 1 on the ray of a pixel within the image, its border of half a pixel included;
  /// exact at pixel centres, between them bilinear (wrong by less than 1/1000 px). NaN where the
  /// lens model ends: no light falls there.
  [[nodiscard]] Eigen::Vector3d ray(double x_px, double y_px) const;

 private:
  [[nodiscard]] const Eigen::Vector2d& node(int x, int y) const;

  int columns_ = 0;
  std::vector<Eigen::Vector2d> nodes_;  ///< at pixel centres, from one beyond each border
};

}  // namespace topoloc::rendering

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/lens.hpp"

#include "rendering/parallel_rows.hpp"

#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Geometry>

namespace topoloc::rendering {

Lens::Lens(const CameraCalibration& calibration, int threads)
    : columns_(calibration.pinhole.width_px + 2) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const int rows = calibration.pinhole.height_px + 2;
  nodes_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows),
                Eigen::Vector2d::Constant(kNan));
  parallel_rows(rows, threads, [&](int row) {
    for (int column = 0; column < columns_; ++column) {
      const auto ray = calibration.unproject({column - 1.0, row - 1.0});
      if (ray) {
        nodes_[static_cast<std::size_t>(row * columns_ + column)] = ray->head<2>();
      }
    }
  });
}

const Eigen::Vector2d& Lens::node(int x, int y) const {
  return nodes_[static_cast<std::size_t>((y + 1) * columns_ + x + 1)];
}

Eigen::Vector3d Lens::ray(double x_px, double y_px) const {
  const double x0 = std::floor(x_px);
  const double y0 = std::floor(y_px);
  const double u = x_px - x0;
  const double v = y_px - y0;
  const int x = static_cast<int>(x0);
  const int y = static_cast<int>(y0);
  if (u == 0.0 && v == 0.0) {
    return node(x, y).homogeneous();
  }
  const Eigen::Vector2d above = (1.0 - u) * node(x, y) + u * node(x + 1, y);
  const Eigen::Vector2d below = (1.0 - u) * node(x, y + 1) + u * node(x + 1, y + 1);
  return ((1.0 - v) * above + v * below).eval().homogeneous();
}

}  // namespace topoloc::rendering

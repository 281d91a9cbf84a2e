// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/mapping/cloud_grid.hpp"

#include <cmath>
#include <functional>

namespace topoloc::mapping {

/// The matching camera in small.
inline const PinholeCamera kCamera{160, 120, 110.0, 110.0, 79.5, 59.5};

using DepthOfPixel = std::function<double(double u_px, double v_px)>;

/// Adds points on a grid of directions (spacing in pixels of kCamera), as a scanner at the camera
/// sees them. World = camera frame. `depth`: Z of the surface there, 0: nothing.
inline void scan(PointCloud& cloud, double step_u_px, double step_v_px, const DepthOfPixel& depth,
                 float intensity = 1.0F) {
  for (double v = 0.3; v < kCamera.height_px - 1; v += step_v_px) {
    for (double u = 0.3; u < kCamera.width_px - 1; u += step_u_px) {
      const double z = depth(u, v);
      if (z > 0.0) {
        cloud.positions_m.emplace_back((z * kCamera.ray({u, v})).cast<float>());
        cloud.intensities.push_back(intensity);
      }
    }
  }
}

/// Wall facing the camera.
inline DepthOfPixel wall(double z_m) {
  return [z_m](double, double) { return z_m; };
}

/// Level ground below the camera, up to a distance.
inline double ground_depth(double v_px, double height_m, double up_to_m) {
  const double below_px = v_px - kCamera.cy_px;
  const double z_m = below_px > 0.0 ? kCamera.fy_px * height_m / below_px : 0.0;
  return z_m < up_to_m ? z_m : 0.0;
}

}  // namespace topoloc::mapping

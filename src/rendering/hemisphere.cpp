// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/hemisphere.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace topoloc::rendering {

const std::array<Eigen::Vector3d, kHemisphereRays>& hemisphere() {
  static const auto directions = [] {
    std::array<Eigen::Vector3d, kHemisphereRays> result;
    // Sunflower: equal areas of the disc below (Malley), turned by the golden angle.
    const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
    for (int i = 0; i < kHemisphereRays; ++i) {
      const double r2 = (i + 0.5) / kHemisphereRays;
      const double r = std::sqrt(r2);
      result[static_cast<std::size_t>(i)] = {r * std::cos(golden * i), r * std::sin(golden * i),
                                             std::sqrt(1.0 - r2)};
    }
    // Neighbours side by side: rays are cast by sixteens.
    std::sort(result.begin(), result.end(),
              [](const auto& a, const auto& b) { return a.x() < b.x(); });
    return result;
  }();
  return directions;
}

// Duff et al. 2017: without a jump but at the pole below.
Eigen::Matrix3d frame_of(const Eigen::Vector3d& normal) {
  const double sign = std::copysign(1.0, normal.z());
  const double a = -1.0 / (sign + normal.z());
  const double b = normal.x() * normal.y() * a;
  Eigen::Matrix3d R;
  R.col(0) << 1.0 + sign * normal.x() * normal.x() * a, sign * b, -sign * normal.x();
  R.col(1) << b, sign + normal.y() * normal.y() * a, -normal.y();
  R.col(2) = normal;
  return R;
}

}  // namespace topoloc::rendering

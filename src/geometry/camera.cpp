// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/geometry/camera.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace topoloc {
namespace {

/// Distorted normalised coordinates of undistorted ones.
Eigen::Vector2d distort(const CameraCalibration& camera, const Eigen::Vector2d& m) {
  const auto& k = camera.coefficients;
  const double x = m.x();
  const double y = m.y();
  const double r2 = x * x + y * y;
  switch (camera.distortion) {
    case Distortion::kNone:
      break;
    case Distortion::kRadTan: {
      const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
      return {x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
              y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y};
    }
    case Distortion::kEquidistant: {
      const double r = std::sqrt(r2);
      if (r < 1e-9) {
        break;
      }
      const double theta = std::atan(r);
      const double t2 = theta * theta;
      const double theta_d = theta * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
      return m * (theta_d / r);
    }
  }
  return m;
}

/// Whether the lens model still grows with the angle all the way to m. Behind a fold of its
/// polynomial lie further solutions, which no real lens has.
bool before_fold(const CameraCalibration& camera, const Eigen::Vector2d& m) {
  std::array<double, 4> k{};
  double reach = m.norm();
  switch (camera.distortion) {
    case Distortion::kNone:
      return true;
    case Distortion::kRadTan:
      k = {camera.coefficients[0], camera.coefficients[1], camera.coefficients[4], 0.0};
      break;
    case Distortion::kEquidistant:
      std::copy_n(camera.coefficients.begin(), k.size(), k.begin());
      reach = std::atan(reach);
      break;
  }
  constexpr int kSteps = 32;
  for (int i = 1; i <= kSteps; ++i) {
    const double s = reach * i / kSteps;
    const double s2 = s * s;
    // derivative of s (1 + k0 s^2 + k1 s^4 + k2 s^6 + k3 s^8)
    if (1.0 + s2 * (3.0 * k[0] + s2 * (5.0 * k[1] + s2 * (7.0 * k[2] + s2 * 9.0 * k[3]))) <= 0.0) {
      return false;
    }
  }
  return true;
}

}  // namespace

Eigen::Vector2d CameraCalibration::project(const Eigen::Vector3d& q_cam) const {
  const Eigen::Vector2d d = distort(*this, q_cam.head<2>() / q_cam.z());
  return {pinhole.fx_px * d.x() + pinhole.cx_px, pinhole.fy_px * d.y() + pinhole.cy_px};
}

std::optional<Eigen::Vector3d> CameraCalibration::unproject(const Eigen::Vector2d& pixel_px) const {
  const Eigen::Vector2d target = pinhole.ray(pixel_px).head<2>();
  // Newton with a numeric Jacobian: the same loop serves every lens model.
  constexpr int kMaxIterations = 20;
  constexpr double kStep = 1e-6;
  constexpr double kTolerance = 1e-11;
  Eigen::Vector2d m = target;
  for (int i = 0; i < kMaxIterations; ++i) {
    const Eigen::Vector2d error = distort(*this, m) - target;
    if (error.norm() < kTolerance) {
      return before_fold(*this, m) ? std::optional(Eigen::Vector3d(m.x(), m.y(), 1.0))
                                   : std::nullopt;
    }
    Eigen::Matrix2d J;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
      J.col(axis) = (distort(*this, m + step) - distort(*this, m - step)) / (2.0 * kStep);
    }
    if (std::abs(J.determinant()) < 1e-9) {
      return std::nullopt;
    }
    m -= J.inverse() * error;
    if (!m.allFinite()) {
      return std::nullopt;
    }
  }
  return std::nullopt;
}

}  // namespace topoloc

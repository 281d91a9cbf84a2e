// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

namespace topoloc {

/// Ideal pinhole camera: what features, map nodes and the estimator use (images are undistorted
/// into it first). Pixel centres at whole numbers; frame: x right, y down, z forward.
struct PinholeCamera {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;

  /// pi(q) = [fx X/Z + cx, fy Y/Z + cy]; the caller makes sure that Z > 0.
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& q_cam) const {
    return {fx_px * q_cam.x() / q_cam.z() + cx_px, fy_px * q_cam.y() / q_cam.z() + cy_px};
  }
  /// Point at depth Z = 1 on the ray of a pixel.
  [[nodiscard]] Eigen::Vector3d ray(const Eigen::Vector2d& pixel_px) const {
    return {(pixel_px.x() - cx_px) / fx_px, (pixel_px.y() - cy_px) / fy_px, 1.0};
  }
  [[nodiscard]] bool contains(const Eigen::Vector2d& pixel_px, double border_px = 0.0) const {
    return pixel_px.x() >= border_px && pixel_px.y() >= border_px &&
           pixel_px.x() <= width_px - 1 - border_px && pixel_px.y() <= height_px - 1 - border_px;
  }
  bool operator==(const PinholeCamera&) const = default;
};

/// Lens models, with Kalibr's names and coefficient orders.
enum class Distortion {
  kNone,
  kRadTan,       ///< Brown-Conrady: k1 k2 p1 p2 [k3]
  kEquidistant,  ///< Kannala-Brandt: k1 k2 k3 k4
};

/// Calibration of a real camera: pinhole plus lens.
struct CameraCalibration {
  PinholeCamera pinhole;
  Distortion distortion = Distortion::kNone;
  std::array<double, 5> coefficients{};  ///< unused ones are zero

  /// Pixel of a camera-frame point through the lens (Z > 0).
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& q_cam) const;

  /// Point at Z = 1 on the ray of a distorted pixel; nothing if the iteration does not converge
  /// (pixel outside the model's range).
  [[nodiscard]] std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel_px) const;

  bool operator==(const CameraCalibration&) const = default;
};

}  // namespace topoloc

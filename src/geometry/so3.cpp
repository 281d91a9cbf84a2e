// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/geometry/so3.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace topoloc::so3 {

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(),  //
      v.z(), 0.0, -v.x(),   //
      -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Matrix3d exp(const Eigen::Vector3d& phi_rad) {
  const double angle_sq = phi_rad.squaredNorm();
  const double angle = std::sqrt(angle_sq);
  double a = 0.0;  // sin(angle) / angle
  double b = 0.0;  // (1 - cos(angle)) / angle^2
  if (angle < kSmallAngle_rad) {
    a = 1.0 - angle_sq / 6.0;
    b = 0.5 - angle_sq / 24.0;
  } else {
    const double half_sine = std::sin(0.5 * angle);
    a = std::sin(angle) / angle;
    b = 2.0 * half_sine * half_sine / angle_sq;
  }
  const Eigen::Matrix3d K = skew(phi_rad);
  return Eigen::Matrix3d::Identity() + a * K + b * K * K;
}

Eigen::Vector3d log(const Eigen::Matrix3d& R) {
  // By way of the quaternion: the vector part stays well conditioned over the whole range.
  Eigen::Quaterniond q(R);
  if (q.w() < 0.0) {
    q.coeffs() = -q.coeffs();
  }
  const double sine = q.vec().norm();  // sin(angle / 2)
  if (sine < 0.5 * kSmallAngle_rad) {
    // angle / sin(angle / 2) for a small angle, with w = cos(angle / 2)
    const double ratio = sine / q.w();
    return q.vec() * (2.0 / q.w() * (1.0 - ratio * ratio / 3.0));
  }
  return q.vec() * (2.0 * std::atan2(sine, q.w()) / sine);
}

Eigen::Matrix3d from_roll_pitch_yaw(const Eigen::Vector3d& rpy_rad) {
  return (Eigen::AngleAxisd(rpy_rad.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy_rad.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy_rad.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& R) {
  return {std::atan2(R(2, 1), R(2, 2)), std::asin(std::clamp(-R(2, 0), -1.0, 1.0)),
          std::atan2(R(1, 0), R(0, 0))};
}

Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& phi_rad) {
  const double angle_sq = phi_rad.squaredNorm();
  const double angle = std::sqrt(angle_sq);
  double b = 0.0;  // (1 - cos(angle)) / angle^2
  double c = 0.0;  // (angle - sin(angle)) / angle^3
  if (angle < kSmallAngle_rad) {
    b = 0.5 - angle_sq / 24.0;
    c = 1.0 / 6.0 - angle_sq / 120.0;
  } else {
    const double half_sine = std::sin(0.5 * angle);
    b = 2.0 * half_sine * half_sine / angle_sq;
    c = (angle - std::sin(angle)) / (angle_sq * angle);
  }
  const Eigen::Matrix3d K = skew(phi_rad);
  return Eigen::Matrix3d::Identity() - b * K + c * K * K;
}

Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& phi_rad) {
  const double angle_sq = phi_rad.squaredNorm();
  const double angle = std::sqrt(angle_sq);
  double d = 0.0;  // (1 - (angle / 2) cot(angle / 2)) / angle^2
  if (angle < 1e-2) {
    // The closed form subtracts nearly equal numbers: its error is 1e-16 / angle^2.
    d = 1.0 / 12.0 + angle_sq / 720.0 + angle_sq * angle_sq / 30240.0;
  } else {
    const double half = 0.5 * angle;
    d = (1.0 - half * std::cos(half) / std::sin(half)) / angle_sq;
  }
  const Eigen::Matrix3d K = skew(phi_rad);
  return Eigen::Matrix3d::Identity() + 0.5 * K + d * K * K;
}

Eigen::Matrix3d renormalised(const Eigen::Matrix3d& R) {
  return R * (1.5 * Eigen::Matrix3d::Identity() - 0.5 * R.transpose() * R);
}

}  // namespace topoloc::so3

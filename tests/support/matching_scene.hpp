// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/so3.hpp"
#include "topoloc/matching/features.hpp"
#include "topoloc/matching/predicted_camera.hpp"

#include <cstdint>
#include <random>
#include <vector>

/// Made-up places for the matching tests: points with descriptors, seen by a camera.
namespace topoloc::testing {

inline PinholeCamera test_camera() {
  return {.width_px = 640,
          .height_px = 384,
          .fx_px = 450,
          .fy_px = 450,
          .cx_px = 319.5,
          .cy_px = 191.5};
}

/// Camera axes (x right, y down, z forward) in an IMU frame (x forward, y left, z up).
inline RigidTransform test_T_imu_cam() {
  RigidTransform T;
  T.R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  T.p = {1.1, -0.3, 0.8};
  return T;
}

/// Numbers that are the same with every standard library.
class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) / 4294967295.0;
  }
  /// Sum of twelve uniforms: close enough to normal.
  double normal(double std) {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) {
      sum += uniform(0.0, 1.0);
    }
    return std * sum;
  }
  int index(int count) { return static_cast<int>(engine_() % static_cast<std::uint32_t>(count)); }
  Eigen::Vector3d vector(double std) { return {normal(std), normal(std), normal(std)}; }
  Eigen::VectorXf descriptor(int dim) {
    Eigen::VectorXf d(dim);
    for (Eigen::Index i = 0; i < d.size(); ++i) {
      d[i] = static_cast<float>(normal(1.0));
    }
    return d.normalized();
  }
  /// A descriptor as another view sees it: cosine to the original about 1 / sqrt(1 + noise^2).
  Eigen::VectorXf seen_again(const Eigen::VectorXf& d, double noise) {
    return (d + static_cast<float>(noise) * descriptor(static_cast<int>(d.size()))).normalized();
  }

 private:
  std::mt19937 engine_;
};

inline void append(matching::FeatureSet& set, const Eigen::Vector2d& pixel_px,
                   const Eigen::VectorXf& d) {
  const auto slot = static_cast<std::size_t>(set.count++);
  set.pixels_px[slot] = pixel_px.cast<float>();
  set.scores[slot] = 1.0F;
  std::copy(d.begin(), d.end(),
            set.descriptors.begin() + static_cast<std::ptrdiff_t>(slot) * set.descriptor_dim);
}

/// A node's points in the world and the current image of them, with the true pose known.
struct Scene {
  RigidTransform T_world_imu_true;
  matching::FeatureSet node;            ///< feature i shows points[i]
  matching::FeatureSet query;           ///< first what shows points, then the rest
  std::vector<Eigen::Vector3d> points;  ///< world
  std::vector<int> truth;               ///< point that a query feature shows, -1: none

  /// `points` points 4 to 50 m ahead, and `distractors` query features anywhere in the image whose
  /// descriptors look like those of points chosen at random: repetitive facades, kerbs, leaves.
  Scene(Random& random, int point_count, int distractors, int dim = 64)
      : node(point_count, dim), query(point_count + distractors, dim) {
    T_world_imu_true = {so3::exp({0.02, -0.03, 0.7}), {350.0, -120.0, 4.0}};
    const PinholeCamera camera = test_camera();
    const RigidTransform T_world_cam = T_world_imu_true * test_T_imu_cam();
    node.width_px = query.width_px = camera.width_px;
    node.height_px = query.height_px = camera.height_px;
    std::vector<Eigen::VectorXf> descriptors;
    for (int i = 0; i < point_count; ++i) {
      const Eigen::Vector2d pixel(random.uniform(5, 634), random.uniform(5, 378));
      const double depth_m = 4.0 * std::exp(random.uniform(0.0, 2.5));
      points.emplace_back(T_world_cam * (depth_m * camera.ray(pixel)));
      descriptors.push_back(random.descriptor(dim));
      append(node, pixel, descriptors.back());
      append(query, pixel + Eigen::Vector2d(random.normal(0.5), random.normal(0.5)),
             random.seen_again(descriptors.back(), 0.5));
      truth.push_back(i);
    }
    for (int i = 0; i < distractors; ++i) {
      const auto& twin = descriptors[static_cast<std::size_t>(random.index(point_count))];
      append(query, {random.uniform(5, 634), random.uniform(5, 378)}, random.seen_again(twin, 0.5));
      truth.push_back(-1);
    }
  }

  [[nodiscard]] std::vector<matching::ProjectedPoint> project(
      const matching::PredictedCamera& camera) const {
    std::vector<matching::ProjectedPoint> out;
    for (const Eigen::Vector3d& p : points) {
      out.push_back(camera.project(p));
    }
    return out;
  }
};

/// Covariance of a prediction with the same uncertainty about all axes.
inline Eigen::Matrix<double, 6, 6> pose_covariance(double angle_std_rad, double position_std_m) {
  Eigen::Matrix<double, 6, 1> variances;
  variances << Eigen::Vector3d::Constant(angle_std_rad * angle_std_rad),
      Eigen::Vector3d::Constant(position_std_m * position_std_m);
  return variances.asDiagonal();
}

}  // namespace topoloc::testing

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"
#include "topoloc/geometry/rigid_transform.hpp"
#include "topoloc/mapping/cloud_grid.hpp"

#include "support/random_states.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace topoloc::refinement {

/// A street along x: ground at z = 0, walls on both sides and at its end. All is painted with
/// irregular patches, which LiDAR and camera see in different contrast.
class TexturedStreet {
 public:
  static constexpr double kHalfWidth_m = 6.0;  ///< walls at y = +- this
  static constexpr double kWall_m = 5.0;       ///< height of the walls
  static constexpr double kBegin_m = -5.0;
  static constexpr double kEnd_m = 40.0;  ///< end wall at x = this

  /// `seed`: of the paint. `striped`: all paint runs along the street, which then looks the same
  /// wherever along x one stands (and has no wall at its end).
  explicit TexturedStreet(std::uint64_t seed, bool striped = false)
      : seed_(seed), striped_(striped) {}

  static PinholeCamera camera() { return {400, 240, 260.0, 260.0, 199.5, 119.5}; }
  /// Looks ahead.
  static RigidTransform T_imu_cam() {
    RigidTransform T;
    T.R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    T.p = {0.5, 0.1, 0.3};
    return T;
  }
  /// A vehicle at x, heading along the street.
  static RigidTransform vehicle_at(double x_m) {
    return {Eigen::Matrix3d::Identity(), {x_m, -1.0, 1.2}};
  }

  /// normal . x = plane(3) of the surface that a point is on.
  static Eigen::Vector4d plane_at(const Eigen::Vector3d& p) {
    constexpr double kOn_m = 1e-6;
    if (std::abs(p.z()) < kOn_m) {
      return {0.0, 0.0, 1.0, 0.0};
    }
    if (std::abs(p.x() - kEnd_m) < kOn_m) {
      return {1.0, 0.0, 0.0, kEnd_m};
    }
    return {0.0, 1.0, 0.0, std::copysign(kHalfWidth_m, p.y())};
  }

  /// Where a ray (any length) first meets the street; nothing in the sky.
  [[nodiscard]] std::optional<Eigen::Vector3d> meet_ray(const Eigen::Vector3d& origin,
                                                        const Eigen::Vector3d& direction) const {
    double nearest = std::numeric_limits<double>::infinity();
    const auto consider = [&](int axis, double at) {
      const double along = (at - origin[axis]) / direction[axis];
      if (!(along > 0.0) || along >= nearest) {
        return;
      }
      const Eigen::Vector3d p = origin + along * direction;
      constexpr double kSlack_m = 1e-9;
      if (p.z() > -kSlack_m && p.z() < kWall_m && std::abs(p.y()) < kHalfWidth_m + kSlack_m &&
          p.x() > kBegin_m && p.x() < kEnd_m + kSlack_m) {
        nearest = along;
      }
    };
    consider(2, 0.0);
    consider(1, kHalfWidth_m);
    consider(1, -kHalfWidth_m);
    if (!striped_) {
      consider(0, kEnd_m);
    }
    if (!std::isfinite(nearest)) {
      return std::nullopt;
    }
    return origin + nearest * direction;
  }

  /// From 0 to 1, of a point on a surface.
  [[nodiscard]] double paint(const Eigen::Vector3d& p) const {
    const Eigen::Vector4d plane = plane_at(p);
    const bool end = plane.x() > 0.5;
    const int surface = plane.z() > 0.5 ? 0 : (end ? 1 : (p.y() > 0.0 ? 2 : 3));
    const double a = striped_ ? 0.0 : (end ? p.y() : p.x());
    const double b = surface == 0 ? p.y() : p.z();
    const double level =
        0.65 * noise(surface, a / 0.9, b / 0.9) + 0.35 * noise(surface + 10, a / 0.35, b / 0.35);
    return level < 0.42 ? 0.15 : (level < 0.58 ? 0.45 : 0.9);
  }

  /// What a LiDAR makes of it.
  [[nodiscard]] mapping::CloudGrid scan(double step_m = 0.05) const {
    mapping::PointCloud cloud;
    cloud.has_intensity = true;
    test::Random random(seed_ + 1000);
    const auto add = [&](const Eigen::Vector3d& p) {
      cloud.positions_m.push_back(p.cast<float>());
      cloud.intensities.push_back(
          static_cast<float>(250.0 * paint(p) * random.uniform(0.85, 1.15)));
    };
    const auto jitter = [&] { return random.uniform(0.0, step_m); };
    for (double x = kBegin_m; x < kEnd_m - step_m; x += step_m) {
      for (double y = -kHalfWidth_m; y < kHalfWidth_m - step_m; y += step_m) {
        add({x + jitter(), y + jitter(), 0.0});
      }
      for (double z = step_m; z < kWall_m - step_m; z += step_m) {
        add({x + jitter(), kHalfWidth_m, z + jitter()});
        add({x + jitter(), -kHalfWidth_m, z + jitter()});
      }
    }
    for (double y = -kHalfWidth_m; !striped_ && y < kHalfWidth_m - step_m; y += step_m) {
      for (double z = step_m; z < kWall_m - step_m; z += step_m) {
        add({kEnd_m, y + jitter(), z + jitter()});
      }
    }
    return mapping::CloudGrid(std::move(cloud));
  }

  /// What a camera makes of it: dark where the LiDAR sees bright, with noise.
  [[nodiscard]] cv::Mat photo(const RigidTransform& T_world_cam) const {
    constexpr std::array kOffsets_px{-0.25, 0.25};  // four rays a pixel
    constexpr double kSky_grey = 235.0;
    constexpr double kNoise_grey = 3.0;
    const PinholeCamera camera = TexturedStreet::camera();
    test::Random random(seed_ + 2000 +
                        static_cast<std::uint64_t>(std::abs(1000.0 * T_world_cam.p.x())));
    cv::Mat image(camera.height_px, camera.width_px, CV_8UC1);
    for (int v = 0; v < image.rows; ++v) {
      for (int u = 0; u < image.cols; ++u) {
        double grey = kNoise_grey * random.normal();
        for (const double du : kOffsets_px) {
          for (const double dv : kOffsets_px) {
            const auto p = meet_ray(T_world_cam.p, T_world_cam.R * camera.ray({u + du, v + dv}));
            grey += 0.25 * (p ? 210.0 - 150.0 * std::sqrt(paint(*p)) : kSky_grey);
          }
        }
        image.at<unsigned char>(v, u) =
            static_cast<unsigned char>(std::clamp(std::lround(grey), 0L, 255L));
      }
    }
    return image;
  }

 private:
  /// Uniform in [0, 1) on whole numbers, smooth in between.
  [[nodiscard]] double noise(int surface, double a, double b) const {
    const double a0 = std::floor(a);
    const double b0 = std::floor(b);
    const auto smooth = [](double x) { return x * x * (3.0 - 2.0 * x); };
    const double fa = smooth(a - a0);
    const double fb = smooth(b - b0);
    const auto at = [&](int da, int db) {
      return hash(surface, static_cast<int>(a0) + da, static_cast<int>(b0) + db);
    };
    return (1.0 - fa) * ((1.0 - fb) * at(0, 0) + fb * at(0, 1)) +
           fa * ((1.0 - fb) * at(1, 0) + fb * at(1, 1));
  }
  [[nodiscard]] double hash(int surface, int a, int b) const {
    // SplitMix64
    std::uint64_t h = seed_;
    for (const int part : {surface, a, b}) {
      h += 0x9e3779b97f4a7c15ULL + static_cast<std::uint64_t>(static_cast<std::int64_t>(part));
      h = (h ^ (h >> 30U)) * 0xbf58476d1ce4e5b9ULL;
      h = (h ^ (h >> 27U)) * 0x94d049bb133111ebULL;
      h ^= h >> 31U;
    }
    return static_cast<double>(h >> 11U) * 0x1.0p-53;
  }

  std::uint64_t seed_;
  bool striped_;
};

}  // namespace topoloc::refinement

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/rendering/lidar.hpp"

#include "topoloc/rendering/camera_renderer.hpp"

#include "unit/rendering/small_world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace topoloc::rendering {
namespace {

using test::car_at;
using test::street;

class LidarScan : public ::testing::Test {
 protected:
  LidarScan() {
    spec_.beams = 32;
    spec_.columns = 720;
    raycaster_.place_moving(std::vector<world::Instance>{car_at(45.0, -1.7)});
  }
  /// The scanner drives along x at 10 m/s.
  static RigidTransform pose(double time_s) {
    RigidTransform T;
    T.p = {20.0 + 10.0 * time_s, -1.7, 1.9};
    return T;
  }
  [[nodiscard]] Ray ray_of(const LidarPoint& point) const {
    const RigidTransform T = pose(1e-9 * point.after_ns);
    return {T.p, T.R * point.p_lidar_m.cast<double>().normalized(), spec_.max_range_m};
  }

  world::World world_ = street();
  std::vector<world::Instance> parked_{car_at(30.0, -4.5), car_at(40.0, 4.5, 3.1)};
  Raycaster raycaster_{world_, parked_};
  LidarSpec spec_;
};

TEST_F(LidarScan, PointsLieOnSurfacesWithinNoise) {
  const auto points = scan(raycaster_, spec_, pose, 1);
  ASSERT_GT(points.size(), 8000U);
  int outside = 0;
  int moving = 0;
  double square_sum = 0.0;
  int steep = 0;
  for (const LidarPoint& point : points) {
    const Ray ray = ray_of(point);
    const auto hit = raycaster_.cast(ray);
    ASSERT_TRUE(hit);
    const double error_m = static_cast<double>(point.p_lidar_m.norm()) - hit->distance_m;
    outside += std::abs(error_m) > 4.0 * std::hypot(spec_.range_noise_m, 0.05) ? 1 : 0;
    EXPECT_EQ(point.moving, hit->moving);
    moving += point.moving ? 1 : 0;
    if (-hit->normal.dot(ray.direction) > 0.7 && hit->distance_m < 20.0) {
      square_sum += error_m * error_m;
      ++steep;
    }
  }
  EXPECT_LE(outside, 3);  // rays at an edge: the point's rounding decides which side
  EXPECT_GT(moving, 10);
  ASSERT_GT(steep, 1000);
  EXPECT_NEAR(std::sqrt(square_sum / steep), spec_.range_noise_m, 0.15 * spec_.range_noise_m);
}

constexpr double kDegree = std::numbers::pi / 180.0;

/// Of points with a depth image, where it is smooth.
struct DepthComparison {
  int compared = 0;
  double off = 0.0;  ///< share of them that lie off it
};

DepthComparison compare(const std::vector<LidarPoint>& points, const RigidTransform& T_cam_lidar,
                        const PinholeCamera& pinhole, const cv::Mat& depth, double range_noise_m) {
  DepthComparison result;
  int off = 0;
  for (const LidarPoint& point : points) {
    const Eigen::Vector3d q = T_cam_lidar * point.p_lidar_m.cast<double>();
    if (q.z() < 1.0) {
      continue;
    }
    const Eigen::Vector2d pixel = pinhole.project(q);
    const int x = static_cast<int>(std::lround(pixel.x()));
    const int y = static_cast<int>(std::lround(pixel.y()));
    if (x < 1 || y < 1 || x > pinhole.width_px - 2 || y > pinhole.height_px - 2) {
      continue;
    }
    const auto depth_m = [&](int right, int down) {
      return static_cast<double>(depth.at<float>(y + down, x + right));
    };
    const auto slope_m = [&](int right, int down) {  // to the next pixels, on either side
      return std::max(std::abs(depth_m(right, down) - depth_m(0, 0)),
                      std::abs(depth_m(-right, -down) - depth_m(0, 0)));
    };
    const double slopes_m = slope_m(1, 0) + slope_m(0, 1);
    constexpr double kSmooth = 0.01;  // of the depth
    if (slopes_m > kSmooth * depth_m(0, 0)) {
      continue;  // an edge, or the road far ahead
    }
    ++result.compared;
    // Points are up to half a pixel beside the pixel's middle.
    off += std::abs(depth_m(0, 0) - q.z()) > 4.0 * range_noise_m + 0.5 * slopes_m ? 1 : 0;
  }
  result.off = static_cast<double>(off) / std::max(result.compared, 1);
  return result;
}

TEST_F(LidarScan, PointsLieOnTheDepthImageOfACameraAndOffThatOfATurnedOne) {
  spec_.beam_divergence_rad = 0.0;  // else slanting echoes have more noise
  const auto points = scan(
      raycaster_, spec_, [](double) { return pose(0.0); }, 2);
  CameraSpec camera;
  camera.calibration.pinhole = {640, 400, 450.0, 450.0, 319.5, 199.5};
  const RigidTransform T_world_cam = test::looking_ahead(pose(0.0).p);
  const RigidTransform T_cam_lidar = T_world_cam.inverse() * pose(0.0);
  const CameraRenderer renderer(raycaster_, camera, Light::kDay, 1);
  const auto seen_when_turned = [&](double angle_rad, const Eigen::Vector3d& axis) {
    RigidTransform T = T_world_cam;
    T.R *= Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
    return compare(points, T_cam_lidar, camera.calibration.pinhole, renderer.depth(T),
                   spec_.range_noise_m);
  };
  const DepthComparison as_said = seen_when_turned(0.0, Eigen::Vector3d::UnitX());
  EXPECT_GT(as_said.compared, 1000);
  EXPECT_LT(as_said.off, 0.004);
  for (const double angle_rad : {-0.3 * kDegree, 0.3 * kDegree}) {
    EXPECT_GT(seen_when_turned(angle_rad, Eigen::Vector3d::UnitX()).off, 0.1);
    EXPECT_GT(seen_when_turned(angle_rad, Eigen::Vector3d::UnitY()).off, 0.1);
    // About its optical axis the middle of the image stays.
    EXPECT_GT(seen_when_turned(angle_rad, Eigen::Vector3d::UnitZ()).off, 0.01);
  }
}

TEST_F(LidarScan, IntensityIsNearInfraredNotAlbedo) {
  const auto points = scan(raycaster_, spec_, pose, 3);
  double nir_error = 0.0;
  double albedo_error = 0.0;
  int dull = 0;
  for (const LidarPoint& point : points) {
    const Ray ray = ray_of(point);
    const auto hit = raycaster_.cast(ray);
    ASSERT_TRUE(hit);
    const double cosine = -hit->normal.dot(ray.direction);
    const world::Appearance look =
        world::appearance(*hit->surface, hit->instance, hit->uv_m,
                          static_cast<float>(hit->distance_m * spec_.beam_divergence_rad /
                                             std::sqrt(std::max(cosine, 0.05))));
    if (look.gloss > 0.01F || look.retro > 0.0F || cosine < 0.2) {
      continue;
    }
    ++dull;
    nir_error += std::abs(static_cast<double>(point.intensity) -
                          std::min(1.0, static_cast<double>(look.nir) * cosine));
    albedo_error += std::abs(static_cast<double>(point.intensity) -
                             std::min(1.0, static_cast<double>(look.albedo) * cosine));
  }
  ASSERT_GT(dull, 1000);
  EXPECT_LT(nir_error / dull, 0.02);
  EXPECT_GT(albedo_error, 2.0 * nir_error);
}

TEST_F(LidarScan, TurnsClockwiseFromBehind) {
  const auto points = scan(raycaster_, spec_, pose, 4);
  std::int32_t last_ns = 0;
  double last_elevation = -10.0;
  for (const LidarPoint& point : points) {
    ASSERT_GE(point.after_ns, last_ns);
    const Eigen::Vector3d p = point.p_lidar_m.cast<double>();
    const double elevation = std::atan2(p.z(), p.head<2>().norm());
    if (point.after_ns == last_ns) {
      ASSERT_GT(elevation, last_elevation);
    }
    last_ns = point.after_ns;
    last_elevation = elevation;
    const double azimuth = std::numbers::pi * (1.0 - 2e-9 * point.after_ns * spec_.rate_hz);
    EXPECT_NEAR(std::remainder(std::atan2(p.y(), p.x()) - azimuth, 2.0 * std::numbers::pi), 0.0,
                1e-4);
  }
  EXPECT_LT(last_ns, 100'000'000);
  EXPECT_GT(last_ns, 99'000'000);
}

TEST_F(LidarScan, IsTheSameWithAnyNumberOfThreads) {
  const auto one = scan(raycaster_, spec_, pose, 5, 1);
  for (const int threads : {2, 3}) {
    const auto more = scan(raycaster_, spec_, pose, 5, threads);
    ASSERT_EQ(one.size(), more.size());
    EXPECT_TRUE(std::equal(one.begin(), one.end(), more.begin(), [](const auto& a, const auto& b) {
      return a.p_lidar_m == b.p_lidar_m && a.intensity == b.intensity && a.after_ns == b.after_ns &&
             a.moving == b.moving;
    }));
  }
  EXPECT_NE(scan(raycaster_, spec_, pose, 6).at(100).p_lidar_m, one.at(100).p_lidar_m);
}

TEST_F(LidarScan, LosesDarkAndFarEchoes) {
  const auto lost = [&](double least_m, double most_m) {
    const auto points = scan(
        raycaster_, spec_, [](double) { return pose(0.0); }, 7);
    int found = 0;
    for (const LidarPoint& point : points) {
      const auto range_m = static_cast<double>(point.p_lidar_m.norm());
      found += range_m > least_m && range_m < most_m ? 1 : 0;
    }
    int cast = 0;
    for (int c = 0; c < spec_.columns; ++c) {
      for (int b = 0; b < spec_.beams; ++b) {
        const double azimuth = std::numbers::pi * (1.0 - 2.0 * c / spec_.columns);
        const double elevation =
            spec_.lowest_rad + (spec_.highest_rad - spec_.lowest_rad) * b / (spec_.beams - 1);
        const Eigen::Vector3d beam(std::cos(elevation) * std::cos(azimuth),
                                   std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
        const auto hit = raycaster_.cast({pose(0.0).p, beam, spec_.max_range_m});
        cast += hit && hit->distance_m > least_m && hit->distance_m < most_m ? 1 : 0;
      }
    }
    return 1.0 - static_cast<double>(found) / cast;
  };
  EXPECT_LT(lost(0.0, 12.0), 0.1);
  EXPECT_GT(lost(45.0, 120.0), 0.3);
}

}  // namespace
}  // namespace topoloc::rendering

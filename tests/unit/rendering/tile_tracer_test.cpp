// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/tile_tracer.hpp"

#include "unit/rendering/small_world.hpp"

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace topoloc::rendering {
namespace {

constexpr float kStep = 10.0F;  // far more than what surfaces reflect at night

/// Each triangle shines in the dark as bright as nothing else: an image says which one every pixel
/// shows. No other light.
void number_triangles(world::World& world) {
  world.lamps.clear();
  world.surfaces.clear();
  for (world::Mesh& mesh : world.meshes) {
    for (world::Triangle& triangle : mesh.triangles) {
      triangle.surface = static_cast<std::uint32_t>(world.surfaces.size());
      const float emission = kStep * static_cast<float>(world.surfaces.size() + 1);
      world.surfaces.push_back({world::Material::kLamp, 1, {emission}});
    }
  }
}

class TiledTown : public ::testing::Test {
 protected:
  TiledTown() {
    number_triangles(world_);
    shading_.begin_frame(std::nullopt);
    calibration_.pinhole = {320, 200, 225.0, 225.0, 159.5, 99.5};
    calibration_.distortion = Distortion::kRadTan;
    calibration_.coefficients = {-0.3, 0.09, 1e-3, -5e-4, -0.01};
    const double along_m = 12.0;
    const double left_m = world_.lanes(along_m).front().left_m;
    const Eigen::Vector3d from_m = world_.route.point(along_m, left_m, 1.4);
    const Eigen::Vector3d ahead = world_.route.point(along_m + 1.0, left_m, 1.4) - from_m;
    T_world_cam_ = test::looking_ahead(from_m);
    T_world_cam_.R = Eigen::AngleAxisd(std::atan2(ahead.y(), ahead.x()), Eigen::Vector3d::UnitZ()) *
                     T_world_cam_.R;
  }

  [[nodiscard]] cv::Mat trace(std::span<const PixelSample> samples) {
    const Lens lens(calibration_, 0);
    const CameraPath path([this](double) { return T_world_cam_; }, 0.0, 0.0);
    const Exposing exposing{&lens, &path, calibration_.pinhole, 0.0, 0.0, samples};
    cv::Mat radiances(calibration_.pinhole.height_px, calibration_.pinhole.width_px, CV_32FC1);
    TileTracer tracer(raycaster_, shading_, exposing);
    for (int row = 0; row < radiances.rows; row += TileTracer::kSide) {
      tracer.trace_rows(row, 0, 1, radiances);
    }
    return radiances;
  }
  /// Light of what one ray meets, through the calibration itself; 0: sky.
  [[nodiscard]] float shines(const Eigen::Vector2d& pixel) const {
    const auto ray = calibration_.unproject(pixel);
    const auto hit = raycaster_.cast({T_world_cam_.p, T_world_cam_.R * ray.value().normalized()});
    return hit ? hit->surface->parameters[0] : 0.0F;
  }
  /// How many of 10,000 random pixels differ from the mean of single rays through their samples.
  [[nodiscard]] int differing(std::span<const PixelSample> samples, double right_px = 0.0) {
    const cv::Mat radiances = trace(samples);
    world::Random random(5);
    int count = 0;
    for (int i = 0; i < 10'000; ++i) {
      const int x = random.below(radiances.cols);
      const int y = random.below(radiances.rows);
      float expected = 0.0F;
      for (const PixelSample& at : samples) {
        expected += shines({x + at.x - 0.5 + right_px, y + at.y - 0.5}) /
                    static_cast<float>(samples.size());
      }
      sky_ += expected == 0.0F ? 1 : 0;
      count += std::abs(radiances.at<float>(y, x) - expected) > 1.0F ? 1 : 0;
    }
    return count;
  }

  world::World world_ = world::make_world({world::Scenario::kTown, 5, 60.0});
  world::Visit visit_{world_, {}};
  Raycaster raycaster_{world_, visit_.parked()};
  Shading shading_{raycaster_, Light::kNight, 1};
  CameraCalibration calibration_;
  RigidTransform T_world_cam_;
  int sky_ = 0;
};

TEST_F(TiledTown, ShowsInEachPixelTheTriangleThatARayThroughItsMiddleMeets) {
  const auto samples = pixel_samples(1);
  const std::span middle = std::span(samples).first(1);
  EXPECT_LE(differing(middle), 5);  // rays that graze an edge, whose rounding differs
  EXPECT_GT(sky_, 500);
  EXPECT_LT(sky_, 5'000);
  EXPECT_GT(differing(middle, 0.1), 100);  // a tenth of a pixel beside it would be seen
}

TEST_F(TiledTown, ShowsInPixelsTheMeanOfTheirSamplesButForWhatAllFirstRaysMiss) {
  const auto samples = pixel_samples(4);
  EXPECT_LE(differing(std::span(samples).first(4)), 100);
}

}  // namespace
}  // namespace topoloc::rendering

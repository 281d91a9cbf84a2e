// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/rendering/camera_renderer.hpp"

#include "rendering/sky.hpp"
#include "unit/rendering/small_world.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace topoloc::rendering {
namespace {

using test::add_rectangle;
using test::add_surface;
using test::car_at;
using test::linear;
using test::looking_ahead;
using test::small_camera;
using test::street;

CameraMotion still(const RigidTransform& T) {
  return [T](double) { return T; };
}

/// Turned about the camera's own axes: to the right, then down.
RigidTransform turned(const RigidTransform& T, double right_rad, double down_rad = 0.0) {
  RigidTransform result = T;
  result.R = T.R * Eigen::AngleAxisd(right_rad, Eigen::Vector3d::UnitY()).toRotationMatrix() *
             Eigen::AngleAxisd(-down_rad, Eigen::Vector3d::UnitX()).toRotationMatrix();
  return result;
}

/// A lamp's rectangle across the x axis, in the dark.
world::World shining(float at_x_m, const Eigen::Vector2f& least, const Eigen::Vector2f& most) {
  world::World world;
  world.meshes.resize(1);
  const Eigen::Vector2f size = most - least;
  add_rectangle(world.meshes[0], {at_x_m, least.x(), least.y()}, {0.0F, size.x(), 0.0F},
                {0.0F, 0.0F, size.y()}, add_surface(world, world::Material::kLamp));
  return world;
}

/// Without noise, and so many electrons to the full well that the lamp is not clipped.
CameraSpec quiet_camera(const world::World& world) {
  CameraSpec spec;
  spec.calibration = small_camera();
  spec.vignetting = 0.0;
  spec.read_noise_electrons = 0.0;
  spec.full_well_electrons = 1e9;
  spec.max_gain = 1.0;
  spec.min_exposure_s = spec.max_exposure_s = 0.01;
  const auto shines =
      static_cast<double>(world::appearance(world.surfaces[0], 0, {0.5F, 0.5F}, 0.1F).emission);
  EXPECT_GT(shines, 0.0);
  spec.electrons_per_s = 0.6 * spec.full_well_electrons / spec.max_exposure_s / shines;
  return spec;
}

cv::Mat render(const world::World& world, const CameraSpec& spec, const CameraMotion& motion,
               Light light = Light::kNight) {
  const Raycaster raycaster(world, {});
  return CameraRenderer(raycaster, spec, light, 1).render(motion, 0);
}

/// Columns from where an edge has a tenth of its height to where it has nine tenths.
double edge_width_px(const cv::Mat& image, int row) {
  const double full = linear(image.at<std::uint8_t>(row, image.cols - 2));
  const auto crossing = [&](double share) {
    for (int column = 1; column < image.cols; ++column) {
      const double before = linear(image.at<std::uint8_t>(row, column - 1)) / full;
      const double after = linear(image.at<std::uint8_t>(row, column)) / full;
      if (before < share && after >= share) {
        return column - 1 + (share - before) / (after - before);
      }
    }
    return -1.0;
  };
  return crossing(0.9) - crossing(0.1);
}

double edge_px(const cv::Mat& image, int row) {  // where all light right of it would be
  double sum = 0.0;
  const double full = linear(image.at<std::uint8_t>(row, image.cols - 2));
  for (int column = 0; column < image.cols; ++column) {
    sum += linear(image.at<std::uint8_t>(row, column)) / full;
  }
  return image.cols - 0.5 - sum;
}

TEST(CameraRenderer, DepthIsThatOfARayThroughTheLens) {
  const world::World world = street();
  Raycaster raycaster(world, std::vector<world::Instance>{car_at(30.0, -4.5)});
  raycaster.place_moving(std::vector<world::Instance>{car_at(25.0, 1.7, 3.14)});
  CameraSpec spec;
  spec.calibration.pinhole = {640, 400, 450.0, 452.0, 321.0, 198.5};
  RigidTransform T = turned(looking_ahead({10.0, -1.7, 1.5}), 0.05, 0.03);
  for (const Distortion distortion : {Distortion::kRadTan, Distortion::kEquidistant}) {
    spec.calibration.distortion = distortion;
    spec.calibration.coefficients = distortion == Distortion::kRadTan
                                        ? std::array{-0.3, 0.09, 1e-3, -5e-4, -0.01}
                                        : std::array{-0.02, 0.005, -0.002, 0.0, 0.0};
    const cv::Mat depth = CameraRenderer(raycaster, spec, Light::kDay, 1).depth(T);
    ASSERT_EQ(depth.type(), CV_32FC1);
    world::Random random(5);
    int hits = 0;
    for (int i = 0; i < 10000; ++i) {
      const int x = random.below(640);
      const int y = random.below(400);
      const auto ray = spec.calibration.unproject({x, y});
      ASSERT_TRUE(ray);
      const auto hit = raycaster.cast({T.p, T.R * ray->normalized()});
      const auto depth_m = static_cast<double>(depth.at<float>(y, x));
      ASSERT_EQ(hit.has_value(), depth_m > 0.0) << x << ' ' << y;
      if (hit) {
        ++hits;
        const Eigen::Vector3d q = T.inverse() * hit->point_m;
        EXPECT_NEAR(depth_m, q.z(), 1e-6 * (1.0 + q.z())) << x << ' ' << y;
        EXPECT_LT((spec.calibration.project(q) - Eigen::Vector2d(x, y)).norm(), 1e-4);
      }
    }
    EXPECT_GT(hits, 5000);
  }
}

TEST(CameraRenderer, ShowsATargetWhereTheCalibrationProjectsIt) {
  for (const Distortion distortion :
       {Distortion::kNone, Distortion::kRadTan, Distortion::kEquidistant}) {
    // A small target up and to the right, where the lens bends most.
    const world::World world = shining(10.0F, {-4.6F, 2.4F}, {-4.0F, 3.0F});
    CameraSpec spec = quiet_camera(world);
    spec.samples_per_pixel = 16;
    spec.calibration.pinhole = {320, 200, 225.0, 225.0, 159.5, 99.5};
    spec.calibration.distortion = distortion;
    if (distortion == Distortion::kRadTan) {
      spec.calibration.coefficients = {-0.3, 0.09, 1e-3, -5e-4, 0.0};
    } else if (distortion == Distortion::kEquidistant) {
      spec.calibration.coefficients = {-0.02, 0.005, -0.002, 0.0, 0.0};
    }
    const RigidTransform T = looking_ahead({0.0, 0.0, 0.0});
    const cv::Mat image = render(world, spec, still(T));
    double weight = 0.0;
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const double light = linear(image.at<std::uint8_t>(y, x));
        weight += light;
        centre += light * Eigen::Vector2d(x, y);
      }
    }
    ASSERT_GT(weight, 10.0);
    Eigen::Vector2d expected = Eigen::Vector2d::Zero();
    constexpr int kGrid = 20;
    for (int i = 0; i < kGrid * kGrid; ++i) {
      const double across = (i % kGrid + 0.5) / kGrid;
      const double up = (static_cast<double>(i / kGrid) + 0.5) / kGrid;
      const Eigen::Vector3d q =
          T.inverse() * Eigen::Vector3d(10.0, -4.6 + 0.6 * across, 2.4 + 0.6 * up);
      expected += spec.calibration.project(q) / (kGrid * kGrid);
    }
    EXPECT_LT((centre / weight - expected).norm(), 0.1) << centre / weight << " for " << expected;
  }
}

TEST(CameraRenderer, TurningBlursAnEdgeByWhatItTurnsWhileExposed) {
  const world::World world = shining(10.0F, {-20.0F, -20.0F}, {0.0F, 20.0F});
  CameraSpec spec = quiet_camera(world);
  spec.samples_per_pixel = 16;
  const double focal_px = spec.calibration.pinhole.fx_px;
  const RigidTransform T = looking_ahead({0.0, 0.0, 0.0});
  const double sharp_px = edge_width_px(render(world, spec, still(T)), 50);
  EXPECT_LT(sharp_px, 1.3);
  for (const double blur_px : {5.0, 12.0}) {
    const double rate_radps = blur_px / focal_px / spec.max_exposure_s;
    const cv::Mat image =
        render(world, spec, [&](double time_s) { return turned(T, rate_radps * time_s); });
    // Light grows evenly across the blur: eight tenths of it lie between one tenth and nine.
    EXPECT_NEAR(edge_width_px(image, 50), 0.8 * blur_px, 0.1 * blur_px);
    EXPECT_NEAR(edge_px(image, 50), 79.5, 0.3);
  }
}

TEST(CameraRenderer, RollingShutterSkewsAnEdgeByWhatItTurnsFromRowToRow) {
  const world::World world = shining(10.0F, {-20.0F, -20.0F}, {0.0F, 20.0F});
  CameraSpec spec = quiet_camera(world);
  spec.samples_per_pixel = 16;
  spec.min_exposure_s = spec.max_exposure_s = 0.001;
  spec.electrons_per_s *= 10.0;
  spec.readout_s = 0.02;
  const RigidTransform T = looking_ahead({0.0, 0.0, 0.0});
  constexpr double kRate_radps = 4.0;
  const cv::Mat image =
      render(world, spec, [&](double time_s) { return turned(T, kRate_radps * time_s); });
  const PinholeCamera& pinhole = spec.calibration.pinhole;
  for (const int row : {0, 25, 50, 75, 99}) {
    const double time_s = spec.readout_s * (row / (pinhole.height_px - 1.0) - 0.5);
    const double expected_px = pinhole.cx_px - pinhole.fx_px * std::tan(kRate_radps * time_s);
    EXPECT_NEAR(edge_px(image, row), expected_px, 0.25) << row;
  }
}

TEST(CameraRenderer, NoiseIsThatOfTheElectrons) {
  const world::World world = shining(10.0F, {-30.0F, -30.0F}, {30.0F, 30.0F});
  for (const double electrons : {60.0, 1000.0, 6000.0}) {
    CameraSpec spec = quiet_camera(world);
    spec.electrons_per_s *= electrons / 0.6 / spec.full_well_electrons;
    spec.full_well_electrons = 10000.0;
    spec.read_noise_electrons = 6.0;
    // As much gain as shows the few in a few hundred steps.
    spec.max_gain = std::clamp(5000.0 / electrons, 1.0, 8.0);
    spec.target_level = 0.99;
    const cv::Mat image = render(world, spec, still(looking_ahead({0.0, 0.0, 0.0})));
    const double gain = spec.max_gain;
    double mean = 0.0;
    double square = 0.0;
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const double counted =
            linear(image.at<std::uint8_t>(y, x)) * spec.full_well_electrons / gain;
        mean += counted;
        square += counted * counted;
      }
    }
    const auto pixels = static_cast<double>(image.total());
    mean /= pixels;
    const double variance = square / pixels - mean * mean;
    // A byte's rounding, as electrons there.
    const double level = gain * mean / spec.full_well_electrons;
    const double byte = 255.0 * (1.055 * std::pow(level, 1.0 / 2.4) - 0.055);
    const double step =
        0.5 * (linear(byte + 1.0) - linear(byte - 1.0)) * spec.full_well_electrons / gain;
    EXPECT_NEAR(mean, electrons, 0.02 * electrons);
    EXPECT_NEAR(variance, electrons + 36.0 + step * step / 12.0, 0.08 * (electrons + 36.0));
  }
}

TEST(CameraRenderer, VignettingTakesItsShareInTheCorners) {
  const world::World world = shining(10.0F, {-30.0F, -30.0F}, {30.0F, 30.0F});
  CameraSpec spec = quiet_camera(world);
  spec.vignetting = 0.35;
  const cv::Mat image = render(world, spec, still(looking_ahead({0.0, 0.0, 0.0})));
  const double middle = linear(image.at<std::uint8_t>(50, 80));
  EXPECT_NEAR(linear(image.at<std::uint8_t>(0, 0)) / middle, 0.65, 0.02);
  EXPECT_NEAR(linear(image.at<std::uint8_t>(99, 159)) / middle, 0.65, 0.02);
  EXPECT_NEAR(linear(image.at<std::uint8_t>(50, 0)) / middle,
              1.0 - 0.35 * 80 * 80 / (80 * 80 + 50 * 50), 0.02);
}

TEST(CameraRenderer, ExposureSettlesAndSwingsAtTheEndsOfTunnels) {
  // A closed shed that one weak lamp lights, beside a street by day.
  world::World world = street();
  test::add_box(world.meshes[0], {-40.0F, 30.0F, 0.0F}, {-10.0F, 40.0F, 6.0F},
                add_surface(world, world::Material::kConcrete));
  world::Lamp lamp;
  lamp.position_m = {-15.0, 35.0, 5.0};
  lamp.intensity = 0.1;
  lamp.cos_cone = -1.0;
  lamp.always_on = true;
  world.lamps.push_back(lamp);
  const Raycaster raycaster(world, {});
  CameraSpec spec;
  spec.calibration = small_camera();
  CameraRenderer renderer(raycaster, spec, Light::kDay, 1);
  const CameraMotion inside = still(looking_ahead({-30.0, 35.0, 1.5}));
  const CameraMotion outside = still(looking_ahead({10.0, -1.7, 1.5}));
  std::uint64_t frame = 0;
  const auto level = [&](const CameraMotion& motion) {
    return cv::mean(renderer.render(motion, frame++))[0] / 255.0;
  };
  EXPECT_NEAR(level(outside), spec.target_level, 0.05);  // the first one too
  const double day_s = renderer.exposure_s();
  EXPECT_LT(day_s, 0.002);
  EXPECT_EQ(renderer.gain(), 1.0);
  EXPECT_LT(level(inside), 0.15);
  EXPECT_LT(level(inside), spec.target_level - 0.1);
  for (int i = 0; i < 20; ++i) {
    level(inside);
  }
  EXPECT_NEAR(level(inside), spec.target_level, 0.05);
  EXPECT_GT(renderer.exposure_s(), 5.0 * day_s);
  EXPECT_GT(level(outside), 0.75);
  EXPECT_GT(level(outside), spec.target_level + 0.1);
  for (int i = 0; i < 20; ++i) {
    level(outside);
  }
  EXPECT_NEAR(level(outside), spec.target_level, 0.03);
  EXPECT_NEAR(renderer.exposure_s(), day_s, 0.1 * day_s);
}

TEST(CameraRenderer, LampsThatAreAlwaysOnShineByDayOthersAtNight) {
  for (const bool always : {false, true}) {
    world::World world = shining(10.0F, {-30.0F, -30.0F}, {30.0F, 30.0F});
    CameraSpec spec = quiet_camera(world);
    spec.electrons_per_s *= 0.1;
    world.surfaces[0].parameters[0] = 5.0F;  // brighter than the day
    world.surfaces[0].parameters[1] = always ? 1.0F : 0.0F;
    const CameraMotion ahead = still(looking_ahead({0.0, 0.0, 0.0}));
    const double night = linear(cv::mean(render(world, spec, ahead, Light::kNight))[0]);
    const double day = linear(cv::mean(render(world, spec, ahead, Light::kOvercast))[0]);
    EXPECT_GT(night, 0.1);
    if (always) {
      EXPECT_GE(day, night);
    } else {
      EXPECT_LT(day, 0.3 * night);
    }
  }
}

TEST(CameraRenderer, HeadLampsLightTheWayAheadAtNight) {
  world::World world;
  world.meshes.resize(1);
  add_rectangle(world.meshes[0], {-50.0F, -50.0F, 0.0F}, {100.0F, 0.0F, 0.0F}, {0.0F, 100.0F, 0.0F},
                add_surface(world, world::Material::kConcrete));
  CameraSpec spec;
  spec.calibration = small_camera();
  spec.min_exposure_s = spec.max_exposure_s = 0.01;
  spec.max_gain = 1.0;
  const RigidTransform T_world_cam = turned(looking_ahead({0.0, 0.0, 1.3}), 0.0, 0.05);
  const auto level = [&](const RigidTransform& T_world_lamps) {
    spec.T_cam_lamps = T_world_cam.inverse() * T_world_lamps;
    const cv::Mat image = render(world, spec, still(T_world_cam));
    return cv::mean(image.rowRange(60, 100))[0];
  };
  const RigidTransform ahead{Eigen::Matrix3d::Identity(), {1.6, 0.0, 0.65}};
  RigidTransform back = ahead;
  back.R = Eigen::AngleAxisd(3.14159, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_GT(level(ahead), 10.0);
  EXPECT_LT(level(back), 0.3 * level(ahead));
}

TEST(CameraRenderer, ADarkNightTakesTheLongestExposureAndGain) {
  const world::World world = street();
  const Raycaster raycaster(world, {});
  CameraSpec spec;
  spec.calibration = small_camera();
  CameraRenderer renderer(raycaster, spec, Light::kNight, 1);
  renderer.render(still(looking_ahead({10.0, -1.7, 1.5})), 0);
  EXPECT_EQ(renderer.exposure_s(), spec.max_exposure_s);
  EXPECT_GT(renderer.gain(), 4.0);
  EXPECT_LE(renderer.gain(), spec.max_gain);
}

TEST(CameraRenderer, ShadowsAreDarkerThanTheSunAndMoveWithVehicles) {
  world::World world = street();
  world.meshes[0] = {};
  world.instances.clear();
  add_rectangle(world.meshes[0], {-50.0F, -50.0F, 0.0F}, {100.0F, 0.0F, 0.0F}, {0.0F, 100.0F, 0.0F},
                0);
  Raycaster raycaster(world, {});
  CameraSpec spec;
  spec.calibration = small_camera();
  spec.min_exposure_s = spec.max_exposure_s = 0.0004;
  spec.max_gain = 1.0;
  const RigidTransform T = turned(looking_ahead({0.0, 0.0, 20.0}), 0.0, 1.57);
  CameraRenderer renderer(raycaster, spec, Light::kDay, 1);
  cv::Mat without = renderer.render(still(T), 0);
  raycaster.place_moving(std::vector<world::Instance>{car_at(0.0, 0.0)});
  cv::Mat with = renderer.render(still(T), 1);
  // Beside the car, half as far as its shadow reaches.
  const Eigen::Vector3d to_sun = illumination(Light::kDay, 1).to_sun;
  const Eigen::Vector2d away = -to_sun.head<2>().normalized();
  const double side_m = std::min(2.25 / std::abs(away.x()), 0.9 / std::abs(away.y()));
  const double shadow_m = 1.5 * to_sun.head<2>().norm() / to_sun.z();
  const Eigen::Vector2d ground_m = Eigen::Vector2d(1.25, 0.0) + (side_m + 0.5 * shadow_m) * away;
  const Eigen::Vector2d pixel =
      spec.calibration.project(T.inverse() * Eigen::Vector3d(ground_m.x(), ground_m.y(), 0.0));
  const cv::Point at(static_cast<int>(std::lround(pixel.x())),
                     static_cast<int>(std::lround(pixel.y())));
  EXPECT_LT(linear(with.at<std::uint8_t>(at)), 0.4 * linear(without.at<std::uint8_t>(at)));
  EXPECT_GT(linear(with.at<std::uint8_t>(at)), 0.02 * linear(without.at<std::uint8_t>(at)));
}

TEST(CameraRenderer, BytesAreTheSameWithAnyNumberOfThreads) {
  world::World world = street();
  world::Lamp lamp;
  lamp.position_m = {30.0, -5.0, 6.0};
  lamp.intensity = 0.02;
  world.lamps.push_back(lamp);
  for (const Light light : {Light::kDay, Light::kOvercast, Light::kDusk, Light::kNight}) {
    std::vector<cv::Mat> first;
    for (const int threads : {1, 2, 3}) {
      Raycaster raycaster(world, std::vector<world::Instance>{car_at(30.0, -4.5)});
      CameraSpec spec;
      spec.calibration = small_camera();
      spec.readout_s = 0.01;
      spec.T_cam_lamps = looking_ahead({-1.6, 0.0, 0.6}).inverse();
      CameraRenderer renderer(raycaster, spec, light, 1, threads);
      for (std::uint64_t frame = 0; frame < 3; ++frame) {
        const auto x = static_cast<double>(frame);
        raycaster.place_moving(std::vector<world::Instance>{car_at(25.0 + 2.0 * x, -1.7)});
        const cv::Mat image = renderer.render(
            [&](double time_s) {
              return looking_ahead({10.0 + x + 10.0 * time_s, -1.7, 1.5});
            },
            frame);
        if (threads == 1) {
          first.push_back(image);
        } else {
          EXPECT_EQ(cv::countNonZero(image != first[frame]), 0) << name(light) << ' ' << threads;
        }
      }
    }
    EXPECT_GT(cv::countNonZero(first[0] != first[1]), 1000);
  }
}

TEST(CameraRenderer, RefusesWhatNoCameraHas) {
  const world::World world = street();
  const Raycaster raycaster(world, {});
  CameraSpec spec;
  EXPECT_THROW(CameraRenderer(raycaster, spec, Light::kDay, 1), std::invalid_argument);
  spec.calibration = small_camera();
  spec.samples_per_pixel = 17;
  EXPECT_THROW(CameraRenderer(raycaster, spec, Light::kDay, 1), std::invalid_argument);
  spec.samples_per_pixel = 1;
  spec.min_exposure_s = 0.1;
  EXPECT_THROW(CameraRenderer(raycaster, spec, Light::kDay, 1), std::invalid_argument);
  spec.min_exposure_s = std::nan("");
  EXPECT_THROW(CameraRenderer(raycaster, spec, Light::kDay, 1), std::invalid_argument);
  spec.min_exposure_s = 0.0001;
  spec.vignetting = 1.5;
  EXPECT_THROW(CameraRenderer(raycaster, spec, Light::kDay, 1), std::invalid_argument);
  spec.vignetting = 0.35;
  spec.rate_hz = 0.0;
  EXPECT_THROW(CameraRenderer(raycaster, spec, Light::kDay, 1), std::invalid_argument);
}

TEST(Light, HasNames) {
  for (const Light light : {Light::kDay, Light::kOvercast, Light::kDusk, Light::kNight}) {
    EXPECT_EQ(light_of(name(light)), light);
  }
  EXPECT_THROW(light_of("dawn"), std::invalid_argument);
}

}  // namespace
}  // namespace topoloc::rendering

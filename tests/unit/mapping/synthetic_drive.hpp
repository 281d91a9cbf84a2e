// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/evaluation/trajectory.hpp"
#include "topoloc/mapping/map_builder.hpp"

#include "support/drive_folder.hpp"
#include "support/matching_scene.hpp"
#include "support/temporary_folder.hpp"

#include <span>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace topoloc::mapping {

/// Drive folder, trajectory and cloud of a vehicle that goes 20 m straight along a street with a
/// wall at its end: 21 frames, 1 m and 0.1 s apart. The images show patchwork, another one in every
/// frame: corners everywhere, whose depth only the cloud can tell.
class SyntheticDrive {
 public:
  static constexpr int kFrames = 21;
  static constexpr std::int64_t kStart_us = 1'700'000'000'000'000;
  static constexpr std::int64_t kFrame_us = 100'000;
  static constexpr double kHalfWidth_m = 6.0;  ///< side walls at y = +- this
  static constexpr double kGround_m = -1.5;    ///< height of the ground
  static constexpr double kEnd_m = 40.0;       ///< end wall at x = this

  SyntheticDrive() {
    write_images(patchwork_images());
    write_trajectory(kStart_us);
    write_cloud(0.0);
  }

  void write_images(std::span<const image_t> images) const { drive_.write_images(images); }

  static std::vector<image_t> patchwork_images() {
    testing::Random random(5);
    std::vector<image_t> images;
    for (int frame = 0; frame < kFrames; ++frame) {
      images.push_back(jpeg(frame, patchwork(random)));
    }
    return images;
  }

  static image_t jpeg(int frame, const cv::Mat& grey) {
    return testing::jpeg_image(kStart_us + frame * kFrame_us, grey);
  }

  /// The poses of all frames, the first at `start_us`.
  void write_trajectory(std::int64_t start_us) const {
    evaluation::Trajectory trajectory;
    for (int frame = 0; frame < kFrames; ++frame) {
      trajectory.push_back({(start_us + frame * kFrame_us) * 1000,
                            {Eigen::Matrix3d::Identity(), {1.0 * frame, 0.0, 0.0}}});
    }
    evaluation::write_tum(paths.trajectory, trajectory);
  }

  /// The ground is dark, the walls are bright.
  static float intensity_at(const Eigen::Vector3f& point) {
    return point.z() < static_cast<float>(kGround_m) + 0.01F ? 0.25F : 0.5F;
  }

  /// The street's walls and ground, moved by `shift_m` along x.
  void write_cloud(double shift_m) const {
    constexpr double kStep_m = 0.07;
    std::vector<Eigen::Vector3f> points;
    const auto add = [&](double x, double y, double z) {
      points.emplace_back(Eigen::Vector3d(x + shift_m, y, z).cast<float>());
    };
    for (double x = 0.0; x < kEnd_m; x += kStep_m) {
      for (double y = -kHalfWidth_m; y < kHalfWidth_m; y += kStep_m) {
        add(x, y, kGround_m);
      }
      for (double z = kGround_m; z < 6.0; z += kStep_m) {
        add(x, -kHalfWidth_m, z);
        add(x, kHalfWidth_m, z);
      }
    }
    for (double y = -kHalfWidth_m; y < kHalfWidth_m; y += kStep_m) {
      for (double z = kGround_m; z < 6.0; z += kStep_m) {
        add(kEnd_m, y, z);
      }
    }
    std::ofstream ply(paths.cloud, std::ios::binary);
    ply << "ply\nformat binary_little_endian 1.0\nelement vertex " << points.size()
        << "\nproperty float x\nproperty float y\nproperty float z\nproperty float "
           "intensity\nend_header\n";
    for (const Eigen::Vector3f& point : points) {
      ply.write(reinterpret_cast<const char*>(point.data()), 3 * sizeof(float));
      const float intensity = intensity_at(point);
      ply.write(reinterpret_cast<const char*>(&intensity), sizeof(intensity));
    }
  }

 private:
  testing::TemporaryFolder folder_;

 public:
  const BuildPaths paths{.drive = folder_ / "drive",
                         .cloud = folder_ / "cloud.ply",
                         .trajectory = folder_ / "poses.tum",
                         .out = folder_ / "map.tmap"};

 private:
  /// Rectangles of all sizes and greys.
  static cv::Mat patchwork(testing::Random& random) {
    const PinholeCamera camera = testing::test_camera();
    cv::Mat image(camera.height_px, camera.width_px, CV_8UC1, cv::Scalar(110));
    for (int i = 0; i < 400; ++i) {
      const int x = random.index(image.cols);
      const int y = random.index(image.rows);
      const int width = 8 + random.index(50);
      const int height = 8 + random.index(50);
      cv::rectangle(image, {x, y, width, height}, cv::Scalar(random.index(256)), cv::FILLED);
    }
    return image;
  }

  /// Its camera is the matching camera already.
  const testing::DriveFolder drive_{paths.drive, testing::test_camera()};
};

}  // namespace topoloc::mapping

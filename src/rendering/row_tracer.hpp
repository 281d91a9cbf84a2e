// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/camera_renderer.hpp"

#include "rendering/camera_path.hpp"
#include "rendering/lens.hpp"
#include "rendering/pixel_samples.hpp"
#include "rendering/shading.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>

namespace topoloc::rendering {

/// What pixels are seen through and when.
struct Exposing {
  const Raycaster* raycaster = nullptr;
  Shading* shading = nullptr;
  const Lens* lens = nullptr;
  const CameraPath* path = nullptr;
  PinholeCamera pinhole;
  double exposure_s = 0.0;
  double readout_s = 0.0;
  std::span<const PixelSample> samples;
};

/// Light that falls on the pixels of a row. One for each thread: it keeps what it works with.
class RowTracer {
 public:
  explicit RowTracer(const Exposing& exposing) : exposing_(exposing) {}

  /// Mean radiances, over a pixel and its exposure, of pixels from a column on, `every` apart.
  void trace(int row, int first_column, int every, std::span<float> radiances);

 private:
  /// Pixels are traced by fours: with four samples each, as many rays as Embree takes at a time.
  static constexpr int kBlock = 4;
  static constexpr std::size_t kMostRays = kBlock * kMostSamples;

  void aim(int row, int column, std::size_t first_ray);
  void cast_to_sun(std::size_t count);
  [[nodiscard]] float radiance(std::size_t first_ray);

  Exposing exposing_;
  std::array<Ray, kMostRays> rays_;
  std::array<std::optional<Hit>, kMostRays> hits_;
  std::array<std::uint8_t, kMostRays> sunlit_{};
  std::array<Ray, kMostRays> sun_rays_;
  std::array<std::size_t, kMostRays> sun_of_{};
  std::array<std::uint8_t, kMostRays> sun_blocked_{};
  std::array<Hit, kMostSamples> patch_hits_;
  std::array<Eigen::Vector3d, kMostSamples> patch_directions_;
};

}  // namespace topoloc::rendering

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "rendering/aim.hpp"
#include "rendering/shading.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

namespace topoloc::rendering {

/// Light that falls on pixels, tile by tile. One for each thread: it keeps what it works with.
///
/// Each pixel of a tile casts one ray first, at another place of the pixel and moment of the
/// exposure than its neighbours. Where all meet one flat surface, all in the sun or all in shadow,
/// the pixels' other samples are computed on its plane. Elsewhere all are cast: edges, shadows'
/// too, are as smooth as with all samples everywhere, but for what all first rays miss: a tenth of
/// the tiles that an edge crosses, a sixth of those with a line half a pixel wide, and most spots
/// smaller than a pixel.
class TileTracer {
 public:
  static constexpr int kSide = 4;  ///< as many pixels as Embree takes rays at a time

  TileTracer(const Raycaster& raycaster, Shading& shading, const Exposing& exposing)
      : raycaster_(&raycaster), shading_(&shading), aim_(exposing) {}

  /// Mean radiances, over a pixel and its exposure, of kSide rows (the last tiles: fewer) of
  /// `radiances` (CV_32FC1), whose pixels lie `every` apart, from pixel `first` on in both
  /// directions.
  void trace_rows(int first_row, int first, int every, cv::Mat& radiances);

 private:
  static constexpr std::size_t kPixels = std::size_t{kSide} * kSide;

  struct Pixel {
    int row = 0;
    int column = 0;
    std::size_t first_sample = 0;
    float* radiance = nullptr;
  };
  /// What a patch counts for in its pixel.
  struct Part {
    std::size_t pixel = 0;
    float share = 0.0F;
  };

  void trace_tile();
  [[nodiscard]] std::size_t sample(std::size_t pixel, std::size_t turn) const;
  [[nodiscard]] Offset offset(std::size_t pixel, std::size_t turn) const;
  void cast(std::size_t first_turn, std::size_t turns);
  void cast_to_sun(std::size_t rays);
  [[nodiscard]] bool all_sky() const;
  [[nodiscard]] bool all_flat() const;
  void show_sky();
  void add_flat_patches(const RayChange& change);
  void share_surroundings();
  void add_patches(std::size_t pixel);
  void shade();

  const Raycaster* raycaster_;
  Shading* shading_;
  Aim aim_;
  std::array<Pixel, kPixels> pixels_;
  std::size_t count_ = 0;  ///< of pixels in the tile
  std::size_t columns_ = 0;
  // By turn (each pixel's first sample, then each one's second...), then pixel.
  std::array<Ray, kPixels * kMostSamples> rays_;
  std::array<std::optional<Hit>, kPixels * kMostSamples> hits_;
  std::array<std::uint8_t, kPixels * kMostSamples> sunlit_{};
  std::array<Ray, kPixels * kMostSamples> sun_rays_;
  std::array<std::size_t, kPixels * kMostSamples> sun_of_{};
  std::array<std::uint8_t, kPixels * kMostSamples> sun_blocked_{};
  std::array<Eigen::Vector2f, kPixels * kMostSamples> uvs_m_;
  std::size_t uvs_ = 0;
  std::vector<Patch> patches_;
  std::vector<Part> parts_;
};

}  // namespace topoloc::rendering

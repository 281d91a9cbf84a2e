// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "rendering/tile_tracer.hpp"

#include <algorithm>
#include <cmath>

namespace topoloc::rendering {
namespace {

/// Whether two samples of a pixel may be shaded as one patch.
bool alike(const Hit& a, const Hit& b) {
  constexpr double kSameWay = 0.97;
  return a.surface == b.surface && a.object == b.object && a.normal.dot(b.normal) > kSameWay &&
         std::abs(a.distance_m - b.distance_m) < 0.5 * a.distance_m;
}

/// Each row and each column of a tile has as different samples as there are, so that few edges and
/// lines slip between them.
std::size_t first_sample(int row, int column, std::size_t samples) {
  constexpr std::array<int, TileTracer::kSide> kTurn{0, 2, 1, 3};
  const int place = (column + kTurn[static_cast<std::size_t>(row)]) % TileTracer::kSide;
  constexpr int kPlaces = TileTracer::kSide * TileTracer::kSide;
  return static_cast<std::size_t>(TileTracer::kSide * place + row) * samples / kPlaces;
}

}  // namespace

void TileTracer::trace_rows(int first_row, int first, int every, cv::Mat& radiances) {
  const int rows = std::min(kSide, radiances.rows - first_row);
  for (int column = 0; column < radiances.cols; column += kSide) {
    const int columns = std::min(kSide, radiances.cols - column);
    count_ = 0;
    columns_ = static_cast<std::size_t>(columns);
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j < columns; ++j) {
        pixels_[count_++] = {first + every * (first_row + i), first + every * (column + j),
                             first_sample(i, j, aim_.samples()),
                             radiances.ptr<float>(first_row + i, column + j)};
        *pixels_[count_ - 1].radiance = 0.0F;
      }
    }
    trace_tile();
  }
}

void TileTracer::trace_tile() {
  patches_.clear();
  parts_.clear();
  uvs_ = 0;
  cast(0, 1);
  if (all_sky()) {
    show_sky();
    return;
  }
  if (all_flat()) {
    cast_to_sun(count_);
    const auto lit = static_cast<std::size_t>(std::count(
        sunlit_.begin(), sunlit_.begin() + static_cast<std::ptrdiff_t>(count_), std::uint8_t{1}));
    const Pixel& middle = pixels_[count_ / 2];
    const RayChange change = aim_.change(middle.row, middle.column);
    if ((lit == 0 || lit == count_) && !change.direction_x.hasNaN() &&
        !change.direction_y.hasNaN()) {
      add_flat_patches(change);
      share_surroundings();
      shade();
      return;
    }
  }
  cast(1, aim_.samples() - 1);
  cast_to_sun(count_ * aim_.samples());
  for (std::size_t pixel = 0; pixel < count_; ++pixel) {
    add_patches(pixel);
  }
  for (Patch& patch : patches_) {
    patch.around = shading_->around(patch);
  }
  shade();
}

std::size_t TileTracer::sample(std::size_t pixel, std::size_t turn) const {
  return (pixels_[pixel].first_sample + turn) % aim_.samples();
}

Offset TileTracer::offset(std::size_t pixel, std::size_t turn) const {
  const Pixel& at = pixels_[pixel];
  return aim_.offset(at.row, at.column, sample(pixel, turn));
}

void TileTracer::cast(std::size_t first_turn, std::size_t turns) {
  for (std::size_t turn = first_turn; turn < first_turn + turns; ++turn) {
    for (std::size_t i = 0; i < count_; ++i) {
      rays_[turn * count_ + i] = aim_.ray(pixels_[i].row, pixels_[i].column, offset(i, turn));
    }
  }
  const std::size_t begin = first_turn * count_;
  raycaster_->cast(std::span(rays_).subspan(begin, turns * count_),
                   std::span(hits_).subspan(begin, turns * count_));
}

/// All of the rays' hits that face the sun, at once.
void TileTracer::cast_to_sun(std::size_t rays) {
  std::size_t cast = 0;
  for (std::size_t i = 0; i < rays; ++i) {
    sunlit_[i] = 0;
    if (!hits_[i]) {
      continue;
    }
    if (const auto ray = shading_->to_sun(*hits_[i], sample(i % count_, i / count_))) {
      sun_rays_[cast] = *ray;
      sun_of_[cast++] = i;
    }
  }
  raycaster_->blocked(std::span(sun_rays_).first(cast), sun_blocked_);
  for (std::size_t i = 0; i < cast; ++i) {
    sunlit_[sun_of_[i]] = sun_blocked_[i] == 0 ? 1 : 0;
  }
}

bool TileTracer::all_sky() const {
  for (std::size_t i = 0; i < count_; ++i) {
    if (hits_[i] || rays_[i].max_m == 0.0) {
      return false;
    }
  }
  return true;
}

/// Whether the first rays meet one surface, in one plane, and not too flatly for RayChange.
bool TileTracer::all_flat() const {
  constexpr double kSameWay = 0.998;
  constexpr double kGrazing = 0.008;
  constexpr double kOff_m = 0.02;
  if (!hits_[0]) {
    return false;
  }
  const Hit& first = *hits_[0];
  const double off_m = kOff_m + 0.5 * aim_.pixel_rad() * first.distance_m;
  for (std::size_t i = 0; i < count_; ++i) {
    if (!hits_[i]) {
      return false;
    }
    const Hit& hit = *hits_[i];
    if (hit.surface != first.surface || hit.object != first.object ||
        hit.normal.dot(first.normal) < kSameWay ||
        std::abs(first.normal.dot(hit.point_m - first.point_m)) > off_m ||
        std::abs(hit.normal.dot(rays_[i].direction)) < kGrazing) {
      return false;
    }
  }
  return true;
}

void TileTracer::show_sky() {
  for (std::size_t i = 0; i < count_; ++i) {
    const Ray ray = aim_.ray(pixels_[i].row, pixels_[i].column, {});
    *pixels_[i].radiance = shading_->sky().radiance(ray.direction);
  }
}

/// One patch for each pixel, its samples on the plane that its first ray met.
void TileTracer::add_flat_patches(const RayChange& change) {
  const std::size_t n = aim_.samples();
  for (std::size_t i = 0; i < count_; ++i) {
    Patch patch;
    patch.hit = *hits_[i];
    patch.direction = rays_[i].direction;
    const Hit& met = *hits_[i];
    const Offset from = offset(i, 0);
    const auto uv_per_m = raycaster_->uv_per_metre(met);
    const auto moved_m = [&](const Offset& to) {
      return change.on_plane_m(met, patch.direction,
                               {to.x - from.x, to.y - from.y, to.time - from.time});
    };
    for (std::size_t turn = 0; turn < n; ++turn) {
      uvs_m_[uvs_ + turn] = met.uv_m + (uv_per_m * moved_m(offset(i, turn))).cast<float>();
    }
    patch.uvs_m = std::span(uvs_m_).subspan(uvs_, n);
    uvs_ += n;
    // Neighbours' first rays go to different places of their pixels: reflections would be ragged.
    const Offset back{-from.x, -from.y, -from.time};
    patch.hit.point_m += moved_m({});
    patch.direction = (patch.direction + change.direction(back)).normalized();
    patch.sunlit = static_cast<float>(sunlit_[i]);
    patch.pixel_rad = aim_.pixel_rad();
    patches_.push_back(patch);
    parts_.push_back({i, 1.0F});
  }
}

/// Light from all sides at the corners of a flat tile, interpolated between them.
void TileTracer::share_surroundings() {
  const std::size_t rows = count_ / columns_;
  const auto corner = [&](std::size_t i, std::size_t j) {
    return shading_->around(patches_[i * (rows - 1) * columns_ + j * (columns_ - 1)]);
  };
  const std::array<float, 4> corners{corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)};
  const auto share = [](std::size_t place, std::size_t places) {
    return places > 1 ? static_cast<float>(place) / static_cast<float>(places - 1) : 0.0F;
  };
  for (std::size_t i = 0; i < count_; ++i) {
    const float down = share(i / columns_, rows);
    const float right = share(i % columns_, columns_);
    patches_[i].around = std::lerp(std::lerp(corners[0], corners[1], right),
                                   std::lerp(corners[2], corners[3], right), down);
  }
}

/// Samples of a pixel, those on one surface together.
void TileTracer::add_patches(std::size_t pixel) {
  const std::size_t n = aim_.samples();
  const float one = 1.0F / static_cast<float>(n);
  Eigen::Vector3d sky_direction = Eigen::Vector3d::Zero();
  int sky_samples = 0;
  std::array<bool, kMostSamples> done{};
  const auto index = [&](std::size_t sample) {
    return (sample + n - pixels_[pixel].first_sample) % n * count_ + pixel;
  };
  for (std::size_t sample = 0; sample < n; ++sample) {
    const Ray& ray = rays_[index(sample)];
    const auto& hit = hits_[index(sample)];
    if (done[sample] || ray.max_m == 0.0) {
      continue;
    }
    if (!hit) {
      sky_direction += ray.direction;
      ++sky_samples;
      continue;
    }
    std::array<std::size_t, kMostSamples> members{};
    std::size_t size = 0;
    float sunlit = 0.0F;
    for (std::size_t other = sample; other < n; ++other) {
      const std::size_t at = index(other);
      if (!done[other] && hits_[at] && alike(*hit, *hits_[at])) {
        done[other] = true;
        members[size++] = at;
        sunlit += static_cast<float>(sunlit_[at]);
        uvs_m_[uvs_ + size - 1] = hits_[at]->uv_m;
      }
    }
    const std::size_t middle = members[size / 2];
    Patch patch;
    patch.hit = *hits_[middle];
    patch.direction = rays_[middle].direction;
    patch.uvs_m = std::span(uvs_m_).subspan(uvs_, size);
    patch.sunlit = sunlit / static_cast<float>(size);
    patch.pixel_rad = aim_.pixel_rad();
    patches_.push_back(patch);
    parts_.push_back({pixel, one * static_cast<float>(size)});
    uvs_ += size;
  }
  if (sky_samples > 0) {
    *pixels_[pixel].radiance += one * static_cast<float>(sky_samples) *
                                shading_->sky().radiance(sky_direction.normalized());
  }
}

void TileTracer::shade() {
  shading_->light_up(patches_);
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    *pixels_[parts_[i].pixel].radiance += parts_[i].share * shading_->radiance(patches_[i]);
  }
}

}  // namespace topoloc::rendering

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/rendering/camera_renderer.hpp"

#include "topoloc/world/random.hpp"

#include "rendering/camera_path.hpp"
#include "rendering/exposure.hpp"
#include "rendering/hemisphere.hpp"
#include "rendering/lens.hpp"
#include "rendering/parallel_rows.hpp"
#include "rendering/pixel_samples.hpp"
#include "rendering/sensor.hpp"
#include "rendering/shading.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

namespace topoloc::rendering {
namespace {

void check(const CameraSpec& spec) {
  const PinholeCamera& pinhole = spec.calibration.pinhole;
  if (pinhole.width_px < 2 || pinhole.height_px < 2 || pinhole.fx_px <= 0.0 ||
      pinhole.fy_px <= 0.0) {
    throw std::invalid_argument("camera: no image size or focal length");
  }
  if (spec.samples_per_pixel < 1 || spec.samples_per_pixel > kMostSamples) {
    throw std::invalid_argument("camera: samples_per_pixel " +
                                std::to_string(spec.samples_per_pixel) + ", expected 1 to " +
                                std::to_string(kMostSamples));
  }
  if (spec.min_exposure_s <= 0.0 || spec.max_exposure_s < spec.min_exposure_s ||
      spec.max_gain < 1.0 || spec.full_well_electrons <= 0.0 || spec.electrons_per_s <= 0.0) {
    throw std::invalid_argument("camera: limits of exposure, gain or electrons make no sense");
  }
}

/// Whether two samples of a pixel may be shaded as one patch.
bool alike(const Hit& a, const Hit& b) {
  constexpr double kSameWay = 0.97;
  return a.surface == b.surface && a.object == b.object && a.normal.dot(b.normal) > kSameWay &&
         std::abs(a.distance_m - b.distance_m) < 0.5 * a.distance_m;
}

/// What the samples of a pixel met; kept from pixel to pixel, since clearing it takes time.
struct Scratch {
  std::array<Ray, kMostSamples> rays;
  std::array<std::optional<Hit>, kMostSamples> hits;
  std::array<Hit, kMostSamples> patch_hits;
  std::array<Eigen::Vector3d, kMostSamples> patch_directions;
};

}  // namespace

struct CameraRenderer::Impl {
  const Raycaster* raycaster;
  CameraSpec spec;
  std::uint64_t seed;
  int threads;
  Lens lens;
  Sensor sensor;
  Shading shading;
  ExposureControl exposure;
  double exposure_s = 0.0;
  double gain = 1.0;
  bool settled = false;

  Impl(const Raycaster& raycaster_, const CameraSpec& spec_, Light light, std::uint64_t seed_,
       int threads_)
      : raycaster(&raycaster_),
        spec(spec_),
        seed(seed_),
        threads(threads_),
        lens(spec.calibration, threads),
        sensor(spec),
        shading(raycaster_, light, seed),
        exposure(spec) {}

  [[nodiscard]] float radiance(int row, int column, const CameraPath& path, double exposure_time_s,
                               std::span<const PixelSample> samples, Scratch& scratch);
  [[nodiscard]] std::optional<HeadLamps> head_lamps(const RigidTransform& T_world_cam) const;
  void settle(const CameraPath& path);
};

/// Mean radiance over a pixel and its exposure.
float CameraRenderer::Impl::radiance(int row, int column, const CameraPath& path,
                                     double exposure_time_s, std::span<const PixelSample> samples,
                                     Scratch& scratch) {
  const PinholeCamera& pinhole = spec.calibration.pinhole;
  const std::size_t n = samples.size();
  auto& [rays, hits, patch_hits, patch_directions] = scratch;
  const double row_s = spec.readout_s * (static_cast<double>(row) / (pinhole.height_px - 1) - 0.5);
  // Times differ from pixel to pixel, else moving edges would show `n` times.
  const double shift =
      static_cast<double>(world::key(seed, {0x71DEU, static_cast<std::uint64_t>(row),
                                            static_cast<std::uint64_t>(column)}) >>
                          11U) *
          0x1p-53 -
      0.5;
  for (std::size_t i = 0; i < n; ++i) {
    const PixelSample& sample = samples[i];
    const double time = sample.time + shift / static_cast<double>(n);
    const RigidTransform T = path.at(row_s + exposure_time_s * (time - 0.5));
    const Eigen::Vector3d ray = lens.ray(column - 0.5 + sample.x, row - 0.5 + sample.y);
    if (std::isnan(ray.x())) {
      return 0.0F;
    }
    rays[i] = {T.p, (T.R * ray).normalized()};
  }
  raycaster->cast(std::span(rays).first(n), std::span(hits).first(n));

  float sum = 0.0F;
  std::array<bool, kMostSamples> done{};
  Eigen::Vector3d sky_direction = Eigen::Vector3d::Zero();
  int sky_samples = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (done[i]) {
      continue;
    }
    if (!hits[i]) {
      sky_direction += rays[i].direction;
      ++sky_samples;
      continue;
    }
    std::size_t count = 0;
    for (std::size_t j = i; j < n; ++j) {
      if (!done[j] && hits[j] && alike(*hits[i], *hits[j])) {
        done[j] = true;
        patch_hits[count] = *hits[j];
        patch_directions[count++] = rays[j].direction;
      }
    }
    sum += static_cast<float>(count) *
           shading.radiance({std::span(patch_hits).first(count),
                             std::span(patch_directions).first(count), 1.0 / pinhole.fx_px});
  }
  if (sky_samples > 0) {
    sum += static_cast<float>(sky_samples) * shading.sky().radiance(sky_direction.normalized());
  }
  return sum / static_cast<float>(n);
}

/// They are lit in the dark: where hardly any sky is to be seen from the camera, by day too.
std::optional<HeadLamps> CameraRenderer::Impl::head_lamps(const RigidTransform& T_world_cam) const {
  if (!shading.light().lamps_lit) {
    const auto open = std::count_if(
        hemisphere().begin(), hemisphere().end(), [&](const Eigen::Vector3d& direction) {
          return !raycaster->blocked({T_world_cam.p, direction}, Obstacles::kFixed);
        });
    if (10 * open >= kHemisphereRays) {
      return std::nullopt;
    }
  }
  return HeadLamps(T_world_cam * spec.T_cam_lamps);
}

/// Exposure of the first frame, as if the camera had been there for a while.
void CameraRenderer::Impl::settle(const CameraPath& path) {
  const PinholeCamera& pinhole = spec.calibration.pinhole;
  const int every = std::max(2, pinhole.width_px / 64);
  const std::array<PixelSample, 1> middle{};
  std::vector<std::vector<float>> seen(static_cast<std::size_t>(pinhole.height_px / every));
  parallel_rows(pinhole.height_px / every, threads, [&](int i) {
    Scratch scratch;
    for (int column = every / 2; column < pinhole.width_px; column += every) {
      const int row = i * every + every / 2;
      seen[static_cast<std::size_t>(i)].push_back(
          sensor.vignetting(row, column) * radiance(row, column, path, 0.0, middle, scratch));
    }
  });
  exposure.settle([&](double total_s) {
    double sum = 0.0;
    double count = 0.0;
    for (const auto& row : seen) {
      for (const float radiance : row) {
        const double electrons = static_cast<double>(radiance) * total_s * spec.electrons_per_s;
        sum += static_cast<double>(
            coded(static_cast<float>(std::min(1.0, electrons / spec.full_well_electrons))));
        count += 1.0;
      }
    }
    return sum / count;
  });
}

CameraRenderer::CameraRenderer(const Raycaster& raycaster, CameraSpec spec, Light light,
                               std::uint64_t seed, int threads) {
  check(spec);
  impl_ = std::make_unique<Impl>(raycaster, spec, light, seed, threads);
}

CameraRenderer::~CameraRenderer() = default;
CameraRenderer::CameraRenderer(CameraRenderer&&) noexcept = default;
CameraRenderer& CameraRenderer::operator=(CameraRenderer&&) noexcept = default;

cv::Mat CameraRenderer::render(const CameraMotion& T_world_cam, std::uint64_t frame) {
  Impl& self = *impl_;
  const PinholeCamera& pinhole = self.spec.calibration.pinhole;
  self.shading.begin_frame(self.head_lamps(T_world_cam(0.0)));
  if (!self.settled) {
    self.settle(CameraPath(T_world_cam, 0.0, self.spec.readout_s));
    self.settled = true;
  }
  self.exposure_s = self.exposure.exposure_s();
  self.gain = self.exposure.gain();
  const CameraPath path(T_world_cam, self.exposure_s, self.spec.readout_s);
  const auto samples = pixel_samples(self.spec.samples_per_pixel);
  const std::span<const PixelSample> used(samples.data(),
                                          static_cast<std::size_t>(self.spec.samples_per_pixel));
  cv::Mat image(pinhole.height_px, pinhole.width_px, CV_8UC1);
  std::vector<double> row_sums(static_cast<std::size_t>(pinhole.height_px));
  parallel_rows(pinhole.height_px, self.threads, [&](int row) {
    auto* bytes = image.ptr<std::uint8_t>(row);
    double sum = 0.0;
    Scratch scratch;
    for (int column = 0; column < pinhole.width_px; ++column) {
      const float light = self.sensor.vignetting(row, column) *
                          self.radiance(row, column, path, self.exposure_s, used, scratch);
      const float share = self.sensor.expose(
          light, self.exposure_s, self.gain,
          world::key(self.seed,
                     {frame, static_cast<std::uint64_t>(row), static_cast<std::uint64_t>(column)}));
      const float level = coded(share);
      bytes[column] = static_cast<std::uint8_t>(255.0F * level + 0.5F);
      sum += static_cast<double>(level);
    }
    row_sums[static_cast<std::size_t>(row)] = sum;
  });
  double sum = 0.0;
  for (const double row_sum : row_sums) {
    sum += row_sum;
  }
  self.exposure.observe(sum / (static_cast<double>(pinhole.width_px) * pinhole.height_px));
  return image;
}

cv::Mat CameraRenderer::depth(const RigidTransform& T_world_cam) const {
  const Impl& self = *impl_;
  const PinholeCamera& pinhole = self.spec.calibration.pinhole;
  cv::Mat image(pinhole.height_px, pinhole.width_px, CV_32FC1);
  parallel_rows(pinhole.height_px, self.threads, [&](int row) {
    auto* depths = image.ptr<float>(row);
    for (int column = 0; column < pinhole.width_px; ++column) {
      const Eigen::Vector3d ray = self.lens.ray(column, row);
      depths[column] = 0.0F;
      if (!std::isnan(ray.x())) {
        const double length = ray.norm();
        const auto hit = self.raycaster->cast({T_world_cam.p, T_world_cam.R * ray / length});
        depths[column] = hit ? static_cast<float>(hit->distance_m / length) : 0.0F;
      }
    }
  });
  return image;
}

double CameraRenderer::exposure_s() const { return impl_->exposure_s; }

double CameraRenderer::gain() const { return impl_->gain; }

}  // namespace topoloc::rendering

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
#include "rendering/tile_tracer.hpp"

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
  const auto positive = [](double number) { return number > 0.0 && std::isfinite(number); };
  const auto share = [](double number) { return number >= 0.0 && number <= 1.0; };
  if (pinhole.width_px < 2 || pinhole.height_px < 2 || !positive(pinhole.fx_px) ||
      !positive(pinhole.fy_px)) {
    throw std::invalid_argument("camera: no image size or focal length");
  }
  if (spec.samples_per_pixel < 1 || spec.samples_per_pixel > kMostSamples) {
    throw std::invalid_argument("camera: samples_per_pixel " +
                                std::to_string(spec.samples_per_pixel) + ", expected 1 to " +
                                std::to_string(kMostSamples));
  }
  if (!positive(spec.min_exposure_s) || !positive(spec.max_exposure_s) ||
      spec.max_exposure_s < spec.min_exposure_s || !(spec.max_gain >= 1.0) ||
      !positive(spec.full_well_electrons) || !positive(spec.electrons_per_s)) {
    throw std::invalid_argument("camera: limits of exposure, gain or electrons make no sense");
  }
  if (!positive(spec.rate_hz)) {
    throw std::invalid_argument("camera: no rate of images");
  }
  if (spec.rate_hz * spec.readout_s > 1.0) {
    throw std::invalid_argument("camera: reads out more slowly than it takes images");
  }
  if (!(spec.readout_s >= 0.0 && spec.read_noise_electrons >= 0.0) || !share(spec.vignetting) ||
      !share(spec.target_level)) {
    throw std::invalid_argument("camera: read-out, noise, vignetting or level make no sense");
  }
}

int tile_rows(const cv::Mat& image) {
  return (image.rows + TileTracer::kSide - 1) / TileTracer::kSide;
}

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

  [[nodiscard]] Exposing exposing(const CameraPath& path, double exposure_time_s,
                                  std::span<const PixelSample> samples) const {
    return {&lens, &path, spec.calibration.pinhole, exposure_time_s, spec.readout_s, samples};
  }
  [[nodiscard]] std::optional<HeadLamps> head_lamps(const RigidTransform& T_world_cam) const;
  void settle(const CameraPath& path);
  /// A row's bytes; the sum of their levels.
  double expose(const cv::Mat& radiances, int row, std::uint64_t frame, cv::Mat& image) const;
};

/// They are lit in the dark: where hardly any sky is to be seen from the camera, by day too.
std::optional<HeadLamps> CameraRenderer::Impl::head_lamps(const RigidTransform& T_world_cam) const {
  if (!spec.T_cam_lamps) {
    return std::nullopt;
  }
  if (!shading.light().lamps_lit) {
    const auto open = std::count_if(
        hemisphere().begin(), hemisphere().end(), [&](const Eigen::Vector3d& direction) {
          return !raycaster->blocked({T_world_cam.p, direction}, Obstacles::kFixed);
        });
    if (10 * open >= kHemisphereRays) {
      return std::nullopt;
    }
  }
  return HeadLamps(T_world_cam * *spec.T_cam_lamps);
}

/// Exposure of the first frame, as if the camera had been there for a while.
void CameraRenderer::Impl::settle(const CameraPath& path) {
  const PinholeCamera& pinhole = spec.calibration.pinhole;
  const int every = std::max(2, pinhole.width_px / 64);
  const std::array<PixelSample, 1> middle{};
  const Exposing exposing_now = exposing(path, 0.0, middle);
  cv::Mat seen(std::max(1, pinhole.height_px / every), std::max(1, pinhole.width_px / every),
               CV_32FC1);
  const int first = every / 2;
  parallel_rows(tile_rows(seen), threads, [&](int i) {
    TileTracer(*raycaster, shading, exposing_now)
        .trace_rows(i * TileTracer::kSide, first, every, seen);
  });
  for (int i = 0; i < seen.rows; ++i) {
    for (int k = 0; k < seen.cols; ++k) {
      seen.at<float>(i, k) *= sensor.vignetting(i * every + first, k * every + first);
    }
  }
  exposure.settle([&](double total_s) {
    double sum = 0.0;
    for (const float radiance : cv::Mat_<float>(seen)) {
      const double electrons = static_cast<double>(radiance) * total_s * spec.electrons_per_s;
      sum += static_cast<double>(
          coded(static_cast<float>(std::min(1.0, electrons / spec.full_well_electrons))));
    }
    return sum / static_cast<double>(seen.total());
  });
}

double CameraRenderer::Impl::expose(const cv::Mat& radiances, int row, std::uint64_t frame,
                                    cv::Mat& image) const {
  double sum = 0.0;
  for (int column = 0; column < image.cols; ++column) {
    const float light = sensor.vignetting(row, column) * radiances.at<float>(row, column);
    const float share = sensor.expose(light, exposure_s, gain,
                                      world::key(seed, {frame, static_cast<std::uint64_t>(row),
                                                        static_cast<std::uint64_t>(column)}));
    const float level = coded(share);
    image.at<std::uint8_t>(row, column) = static_cast<std::uint8_t>(std::lround(255.0F * level));
    sum += static_cast<double>(level);
  }
  return sum;
}

CameraRenderer::CameraRenderer(const Raycaster& raycaster, const CameraSpec& spec, Light light,
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
  const Exposing exposing = self.exposing(path, self.exposure_s, used);
  cv::Mat image(pinhole.height_px, pinhole.width_px, CV_8UC1);
  std::vector<double> row_sums(static_cast<std::size_t>(pinhole.height_px));
  cv::Mat radiances(image.size(), CV_32FC1);
  parallel_rows(tile_rows(image), self.threads, [&](int i) {
    const int first_row = i * TileTracer::kSide;
    TileTracer(*self.raycaster, self.shading, exposing).trace_rows(first_row, 0, 1, radiances);
    for (int row = first_row; row < std::min(first_row + TileTracer::kSide, image.rows); ++row) {
      row_sums[static_cast<std::size_t>(row)] = self.expose(radiances, row, frame, image);
    }
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

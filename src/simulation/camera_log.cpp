// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/simulation/camera_log.hpp"

#include "topoloc/transport/image_view.hpp"
#include "topoloc/transport/lcm_log.hpp"
#include "topoloc/world/random.hpp"

#include <cmath>
#include <stdexcept>
#include <topoloc/image_t.hpp>
#include <vector>

#include <opencv2/imgcodecs.hpp>

namespace topoloc::simulation {
namespace {

/// From mid-exposure of the last row: the rest of its exposure and the way to the log.
constexpr std::int64_t kTransfer_us = 24'000;

std::vector<std::byte> message(const cv::Mat& grey, std::int64_t time_us, int quality) {
  image_t image{};
  image.utime = time_us;
  image.width = grey.cols;
  image.height = grey.rows;
  image.pixelformat = transport::kPixelFormatMjpeg;
  if (!cv::imencode(".jpg", grey, image.data, {cv::IMWRITE_JPEG_QUALITY, quality})) {
    throw std::runtime_error("a camera image cannot be encoded as JPEG");
  }
  image.size = static_cast<std::int32_t>(image.data.size());
  std::vector<std::byte> bytes(static_cast<std::size_t>(image.getEncodedSize()));
  image.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace

CameraLogCounts film(rendering::Raycaster& raycaster, const Ego& ego, const world::Visit& visit,
                     const RigidTransform& T_vehicle_cam, const rendering::CameraSpec& camera,
                     rendering::Light light, const CameraLogSpec& spec, std::int64_t begin_ns,
                     std::uint64_t key, const std::filesystem::path& file,
                     const std::function<void(double)>& progress) {
  rendering::CameraRenderer renderer(raycaster, camera, light, world::key(key, {1}));
  world::Random random(world::key(key, {2}));
  transport::LcmLogWriter log(file);
  CameraLogCounts counts;
  // Away from the ends, where half an exposure would be missing.
  const double first_s = 0.05;
  const auto frames =
      static_cast<std::int64_t>(std::floor((ego.duration_s() - 2.0 * first_s) * camera.rate_hz)) +
      1;
  const std::int64_t readout_us = std::llround(1e6 * camera.readout_s);
  for (std::int64_t i = 0; i < frames; ++i) {
    const double time_s = first_s + static_cast<double>(i) / camera.rate_hz;
    const double along_m = ego.along_m(time_s);
    raycaster.place_moving(visit.moving(time_s, along_m, ego.path.left_m(along_m)));
    const auto motion = [&](double since_s) {
      return ego.trajectory.at(time_s + since_s).T_world_body * T_vehicle_cam;
    };
    const cv::Mat grey = renderer.render(motion, static_cast<std::uint64_t>(i));
    const double stamp_s = time_s - spec.time_shift_s + spec.jitter_s * random.normal();
    const std::int64_t time_us = (begin_ns + std::llround(stamp_s * 1e9) + 500) / 1000;
    const std::vector<std::byte> bytes = message(grey, time_us, spec.jpeg_quality);
    log.write(time_us + kTransfer_us + readout_us / 2, "CAMERA", bytes);
    ++counts.frames;
    counts.bytes += bytes.size();
    progress(static_cast<double>(i + 1) / static_cast<double>(frames));
  }
  log.close();
  raycaster.place_moving({});
  return counts;
}

}  // namespace topoloc::simulation

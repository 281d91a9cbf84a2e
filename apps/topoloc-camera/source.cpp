// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/camera_list.hpp"
#include "topoloc/camera/v4l2_source.hpp"

#include "options.hpp"
#include "recordings.hpp"

#include <cmath>
#include <map>

#include <fmt/core.h>

namespace topoloc::apps {
namespace {

camera::CameraRequest request_of(const CameraOptions& options) {
  const std::map<std::string, std::optional<camera::PixelLayout>> layouts = {
      {"auto", std::nullopt},
      {"grey", camera::PixelLayout::kGrey},
      {"mjpeg", camera::PixelLayout::kMjpeg},
      {"yuyv", camera::PixelLayout::kYuyv},
  };
  camera::CameraRequest request{.device = options.device,
                                .width_px = options.width_px,
                                .height_px = options.height_px,
                                .fps = options.fps,
                                .layout = layouts.at(options.format),
                                .exposure_ns = {},
                                .stamp_offset_ns = std::llround(options.stamp_offset_ms * 1e6),
                                .stamp_on_arrival = options.stamp_source == "arrival"};
  if (options.exposure_ms) {
    request.exposure_ns = std::llround(*options.exposure_ms * 1e6);
  }
  return request;
}

}  // namespace

std::unique_ptr<camera::ImageSource> make_source(const CameraOptions& options,
                                                 const camera::Report& report) {
  if (options.device.empty()) {
    return make_recording(options, report);
  }
  auto source = std::make_unique<camera::V4l2Source>(camera::system_video_calls(),
                                                     request_of(options), report);
  const camera::CameraMode& mode = source->mode();
  report(fmt::format("{}: {} of {}x{}{}", options.device, camera::fourcc_text(mode.code),
                     mode.size.width_px, mode.size.height_px,
                     mode.fps > 0.0 ? fmt::format(", {:.2f} images a second", mode.fps) : ""));
  return source;
}

bool list_cameras() {
  bool any = false;
  for (const camera::ListedCamera& listed : camera::list_cameras(camera::system_video_calls())) {
    if (!listed.problem.empty()) {
      fmt::print("{}\n", listed.problem);
      continue;
    }
    fmt::print("{}: {} ({}){}\n", listed.device, listed.name, listed.bus,
               listed.formats.empty() ? ": gives no images" : "");
    for (const camera::OfferedFormat& format : listed.formats) {
      fmt::print("  {}{}: {}\n", format.name, format.usable ? "" : " (cannot be used here)",
                 format.sizes);
      any = any || format.usable;
    }
  }
  if (!any) {
    fmt::print(
        "no camera that can be used (v4l2-ctl --list-devices shows what the kernel knows)\n");
  }
  return any;
}

}  // namespace topoloc::apps

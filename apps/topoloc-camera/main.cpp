// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/image_bridge.hpp"
#include "topoloc/transport/lcm_log.hpp"

#include "common/run_app.hpp"
#include "common/stop_request.hpp"
#include "common/text_file.hpp"
#include "options.hpp"
#include "summary.hpp"

#include <atomic>
#include <cstdio>
#include <exception>
#include <map>
#include <stdexcept>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <fmt/core.h>
#include <lcm/lcm-cpp.hpp>

namespace {

namespace camera = topoloc::camera;
using topoloc::apps::CameraOptions;

constexpr const char* kExamples = R"(
Examples:
  topoloc-camera --list
  topoloc-camera --device /dev/video0 --width 1280 --height 720 --fps 20 --format mjpeg
  topoloc-camera --device /dev/v4l/by-id/usb-front-video-index0 --format grey --stamp-offset-ms -12.5
  topoloc-camera --folder images --fps 10 --loop
  topoloc-camera --folder images --stamps times.txt --keep-stamps --duration 60
  topoloc-camera --video drive.mp4 --publish mjpeg --mjpeg-quality 85

Stamps mean mid-exposure, Unix time by the system clock; recorded images get the present time unless
--keep-stamps. A camera that is unplugged is used again once it is back. Ctrl-C ends it with the
summary; docs/camera.md. Exit code: 0 done, 1 failed, 2 wrong usage.)";

const std::map<std::string, camera::ImageForm> kForms = {
    {"as-is", camera::ImageForm::kAsTheyCome},
    {"grey", camera::ImageForm::kGrey},
    {"mjpeg", camera::ImageForm::kMjpeg},
};

using topoloc::apps::stop_requested;

void add_options(CLI::App& app, CameraOptions& options) {
  auto* device = app.add_option("--device", options.device, "V4L2 camera, such as /dev/video0");
  auto* folder = app.add_option("--folder", options.folder, "Folder of images, in order of name");
  auto* video = app.add_option("--video", options.video, "Video file");
  auto* list = app.add_flag("--list", options.list, "List cameras with their formats, and end");
  device->excludes(folder)->excludes(video)->excludes(list);
  folder->excludes(video)->excludes(list);
  video->excludes(list);
  app.add_option("--fps", options.fps,
                 "Images per second; default: the camera's, the video's, 10 for a folder")
      ->check(CLI::Range(0.01, 10000.0));
  app.add_option("--stamp-offset-ms", options.stamp_offset_ms,
                 "Calibrated constant, added to every stamp")
      ->check(CLI::Range(-10000.0, 10000.0))
      ->capture_default_str();

  const auto of_camera = [&](CLI::Option* option) { option->group("Of a camera")->needs(device); };
  of_camera(app.add_option("--width", options.width_px, "Pixels; default: as the camera is set")
                ->check(CLI::Range(1, 16384)));
  of_camera(app.add_option("--height", options.height_px, "Pixels; default: as the camera is set")
                ->check(CLI::Range(1, 16384)));
  of_camera(app.add_option("--format", options.format,
                           "What the camera sends; auto: the first of grey, mjpeg, yuyv it has")
                ->check(CLI::IsMember({"auto", "grey", "mjpeg", "yuyv"}))
                ->capture_default_str());
  of_camera(app.add_option("--exposure-ms", options.exposure_ms,
                           "Exposure time where the camera does not tell it, or sets it by itself")
                ->check(CLI::Range(0.0, 10000.0)));
  of_camera(app.add_option("--stamp-source", options.stamp_source,
                           "driver: the driver's stamp; arrival: when the image was handed over")
                ->check(CLI::IsMember({"driver", "arrival"}))
                ->capture_default_str());

  const auto of_files = [&](CLI::Option* option) {
    option->group("Of images and videos")->excludes(device);
    return option;
  };
  of_files(app.add_option("--stamps", options.stamps,
                          "File of times, one a line: seconds with a decimal point or whole "
                          "nanoseconds; then, if you like, the image's name"));
  auto* keep = of_files(app.add_flag("--keep-stamps", options.keep_stamps,
                                     "Recorded times, not the present (needs --stamps)"));
  keep->needs("--stamps")
      ->excludes(of_files(app.add_flag("--loop", options.loop, "Again and again; stamps go on")));

  app.add_option("--lcm", options.lcm, "LCM URL")->capture_default_str();
  app.add_option("--channel", options.channel, "LCM channel")->capture_default_str();
  app.add_option("--publish", options.publish,
                 "as-is: JPEG as it comes, all else raw grey; or always grey, or mjpeg")
      ->check(CLI::IsMember(kForms))
      ->capture_default_str();
  app.add_option("--mjpeg-quality", options.mjpeg_quality, "1 to 100, where it must encode")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--duration", options.duration_s, "End after so many seconds; 0: never")
      ->check(CLI::Range(0.0, 1e9))
      ->capture_default_str();
  app.add_option("--json", options.json, "Write the summary as JSON to this file, - for stdout");
}

void check_usage(const CameraOptions& options) {
  if (options.device.empty() && options.folder.empty() && options.video.empty() && !options.list) {
    throw CLI::RequiredError("--device, --folder, --video or --list");
  }
  if (options.channel.empty() || options.channel.size() > topoloc::transport::kMaxChannelBytes) {
    throw CLI::ValidationError("--channel", "expected a name of 1 to 63 bytes");
  }
}

/// Once a second, where someone looks.
class Progress {
 public:
  void operator()(const camera::BridgeSummary& summary) {
    constexpr std::int64_t kPeriod_us = 1'000'000;
    if (isatty(STDERR_FILENO) == 1 && summary.last_us - shown_us_ >= kPeriod_us) {
      shown_us_ = summary.last_us;
      fmt::print(stderr, "\r{} images, {:.2f} a second ", summary.published, summary.rate_hz());
    }
  }

 private:
  std::int64_t shown_us_ = 0;
};

void report(const std::string& line) { fmt::print(stderr, "topoloc-camera: {}\n", line); }

int run(const CameraOptions& options) {
  if (options.list) {
    return topoloc::apps::list_cameras() ? 0 : 1;
  }
  lcm::LCM lcm(options.lcm);
  if (!lcm.good()) {
    throw std::runtime_error("--lcm " + options.lcm +
                             ": LCM does not start (on one machine it needs multicast on lo: ip "
                             "link set lo multicast on; ip route add 224.0.0.0/4 dev lo)");
  }
  const auto source = topoloc::apps::make_source(options, report);
  const camera::BridgeConfig config{.form = kForms.at(options.publish),
                                    .jpeg_quality = options.mjpeg_quality,
                                    .duration_s = options.duration_s};
  Progress progress;
  const camera::BridgeSummary published = camera::publish_images(
      *source, config,
      [&](std::span<const std::byte> message) {
        return lcm.publish(options.channel, message.data(),
                           static_cast<unsigned>(message.size())) == 0;
      },
      stop_requested, [&](const camera::BridgeSummary& summary) { progress(summary); });

  const nlohmann::json summary = topoloc::apps::to_json(published, *source);
  if (!options.json.empty()) {
    topoloc::apps::write_text(options.json, summary.dump(2) + "\n");
  }
  if (options.json != "-") {
    fmt::print("{}", topoloc::apps::to_text(summary));
  }
  if (published.published == 0 && !stop_requested) {
    throw std::runtime_error("no image was published");
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Publishes the images of a camera, a folder or a video on LCM (image_t)."};
  app.footer(kExamples);
  app.set_version_flag("--version", TOPOLOC_VERSION);
  CameraOptions options;
  add_options(app, options);
  return topoloc::apps::run_app(app, "topoloc-camera", argc, argv, [&] {
    check_usage(options);
    topoloc::apps::stop_on_signals();
    return run(options);
  });
}

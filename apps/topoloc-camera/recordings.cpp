// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "recordings.hpp"

#include "topoloc/camera/image_folder.hpp"
#include "topoloc/camera/image_times.hpp"
#include "topoloc/camera/played_images.hpp"
#include "topoloc/camera/stamps_file.hpp"
#include "topoloc/camera/video_file.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include <opencv2/core/utils/logger.hpp>

namespace topoloc::apps {
namespace {

namespace fs = std::filesystem;

constexpr double kFolderFps = 10.0;

std::vector<fs::path> files_of(const CameraOptions& options,
                               const std::vector<camera::ImageStamp>& stamps) {
  if (stamps.empty() || stamps.front().name.empty()) {
    std::vector<fs::path> files = camera::list_images(options.folder);
    if (!stamps.empty() && stamps.size() != files.size()) {
      throw std::runtime_error(options.stamps.string() + ": " + std::to_string(stamps.size()) +
                               " time stamps for " + std::to_string(files.size()) + " images in " +
                               options.folder.string() +
                               " (write the images' names behind the times if some are to be left "
                               "out)");
    }
    return files;
  }
  std::vector<fs::path> files;
  files.reserve(stamps.size());
  for (const camera::ImageStamp& stamp : stamps) {
    files.push_back(options.folder / stamp.name);
    if (!fs::is_regular_file(files.back())) {
      throw std::runtime_error(options.stamps.string() + ": names '" + stamp.name +
                               "', which is not in " + options.folder.string());
    }
  }
  return files;
}

}  // namespace

std::unique_ptr<camera::ImageSource> make_recording(const CameraOptions& options,
                                                    const camera::Report& report) {
  std::vector<camera::ImageStamp> stamps;
  if (!options.stamps.empty()) {
    stamps = camera::read_stamps(options.stamps);
  }
  double fps = options.fps.value_or(kFolderFps);
  std::unique_ptr<camera::RecordedImages> images;
  if (!options.folder.empty()) {
    images = std::make_unique<camera::FolderImages>(files_of(options, stamps));
  } else {
    // Its decoders tell at length what they tried; the error that follows says what matters.
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    auto video = std::make_unique<camera::VideoImages>(options.video);
    fps = options.fps.value_or(video->fps());
    if (stamps.empty() && !(fps > 0.0)) {
      throw std::runtime_error(options.video.string() +
                               ": does not say how many images a second it has: give --fps or "
                               "--stamps");
    }
    images = std::move(video);
  }
  return std::make_unique<camera::PlayedImages>(
      std::move(images), stamps.empty() ? camera::ImageTimes(fps) : camera::ImageTimes(stamps),
      camera::PlayedImages::Config{.loop = options.loop,
                                   .keep_stamps = options.keep_stamps,
                                   .offset_ns = std::llround(options.stamp_offset_ms * 1e6)},
      report);
}

}  // namespace topoloc::apps

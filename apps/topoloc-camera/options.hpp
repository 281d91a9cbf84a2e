// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/camera/image_source.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace topoloc::apps {

struct CameraOptions {
  std::string device;
  std::filesystem::path folder;
  std::filesystem::path video;
  bool list = false;

  std::optional<int> width_px;
  std::optional<int> height_px;
  std::string format = "auto";
  std::optional<double> fps;
  std::optional<double> exposure_ms;
  double stamp_offset_ms = 0.0;
  std::string stamp_source = "driver";

  std::filesystem::path stamps;
  bool keep_stamps = false;
  bool loop = false;

  std::string lcm = "udpm://239.255.76.67:7667?ttl=0";
  std::string channel = "CAMERA";
  std::string publish = "as-is";
  int mjpeg_quality = 90;
  double duration_s = 0.0;
  std::string json;
};

/// The source that the options name. Throws std::runtime_error (and its kin) that says what is
/// wrong with it.
std::unique_ptr<camera::ImageSource> make_source(const CameraOptions& options,
                                                 const camera::Report& report);

/// Prints the cameras of this machine with their formats; whether there is one.
bool list_cameras();

}  // namespace topoloc::apps

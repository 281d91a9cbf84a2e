// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/camera/video_calls.hpp"

#include <string>
#include <vector>

namespace topoloc::camera {

struct OfferedFormat {
  std::string name;     ///< such as "MJPG"
  bool usable = false;  ///< by topoloc-camera
  std::string sizes;    ///< with their highest rates
};

/// A device file, whether or not it is a camera that can be used.
struct ListedCamera {
  std::string device;
  std::string problem;  ///< why nothing else is known; empty if it was asked
  std::string name;
  std::string bus;                     ///< where it is plugged in
  std::vector<OfferedFormat> formats;  ///< none: it gives no images
};

std::vector<ListedCamera> list_cameras(VideoCalls& calls);

}  // namespace topoloc::camera

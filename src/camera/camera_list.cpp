// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/camera_list.hpp"

#include "topoloc/camera/pixel_layout.hpp"

#include "camera/camera_errors.hpp"
#include "camera/v4l2_formats.hpp"

#include <algorithm>

namespace topoloc::camera {
namespace {

/// A fixed field of a struct, which need not end in a zero.
template <std::size_t kSize>
std::string text_of(const __u8 (&field)[kSize]) {
  return {std::begin(field), std::find(std::begin(field), std::end(field), 0)};
}

void ask(VideoCalls& calls, int descriptor, ListedCamera& camera) {
  v4l2_capability capability{};
  if (const int error = calls.control(descriptor, VIDIOC_QUERYCAP, &capability); error < 0) {
    camera.problem = camera_error_text(camera.device, "is no V4L2 device", -error);
    return;
  }
  camera.name = text_of(capability.card);
  camera.bus = text_of(capability.bus_info);
  if ((device_capabilities(capability) & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    return;
  }
  for (const std::uint32_t code : format_codes(calls, descriptor)) {
    camera.formats.push_back({.name = fourcc_text(code),
                              .usable = layout_of(code).has_value(),
                              .sizes = sizes_text(calls, descriptor, code)});
  }
}

}  // namespace

std::vector<ListedCamera> list_cameras(VideoCalls& calls) {
  std::vector<ListedCamera> cameras;
  for (const std::string& device : calls.devices()) {
    ListedCamera& camera = cameras.emplace_back();
    camera.device = device;
    const int descriptor = calls.open(device);
    if (descriptor < 0) {
      camera.problem = camera_error_text(device, "cannot be opened", -descriptor);
      continue;
    }
    ask(calls, descriptor, camera);
    calls.close(descriptor);
  }
  return cameras;
}

}  // namespace topoloc::camera

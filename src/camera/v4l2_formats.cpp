// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "camera/v4l2_formats.hpp"

#include <algorithm>

#include <fmt/core.h>

namespace topoloc::camera {
namespace {

constexpr std::uint32_t kMaxEntries = 256;  // of a list: no driver has so many

/// Highest rate of a size; 0 if the driver does not tell.
double highest_fps(VideoCalls& calls, int descriptor, std::uint32_t code, std::uint32_t width,
                   std::uint32_t height) {
  double highest = 0.0;
  for (std::uint32_t index = 0; index < kMaxEntries; ++index) {
    v4l2_frmivalenum interval{};
    interval.index = index;
    interval.pixel_format = code;
    interval.width = width;
    interval.height = height;
    if (calls.control(descriptor, VIDIOC_ENUM_FRAMEINTERVALS, &interval) < 0) {
      break;
    }
    const bool discrete = interval.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    const v4l2_fract& shortest = discrete ? interval.discrete : interval.stepwise.min;
    if (shortest.numerator != 0) {
      highest = std::max(highest, static_cast<double>(shortest.denominator) / shortest.numerator);
    }
    if (!discrete) {
      break;
    }
  }
  return highest;
}

}  // namespace

std::uint32_t device_capabilities(const v4l2_capability& capability) {
  return (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                               : capability.capabilities;
}

std::vector<std::uint32_t> format_codes(VideoCalls& calls, int descriptor) {
  std::vector<std::uint32_t> codes;
  for (std::uint32_t index = 0; index < kMaxEntries; ++index) {
    v4l2_fmtdesc format{};
    format.index = index;
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (calls.control(descriptor, VIDIOC_ENUM_FMT, &format) < 0) {
      break;
    }
    codes.push_back(format.pixelformat);
  }
  return codes;
}

std::uint32_t code_of(PixelLayout layout, std::span<const std::uint32_t> codes) {
  const auto found = std::find_if(codes.begin(), codes.end(),
                                  [&](std::uint32_t code) { return layout_of(code) == layout; });
  return found == codes.end() ? fourcc(layout) : *found;
}

std::string sizes_text(VideoCalls& calls, int descriptor, std::uint32_t code) {
  std::string text;
  for (std::uint32_t index = 0; index < kMaxEntries; ++index) {
    v4l2_frmsizeenum size{};
    size.index = index;
    size.pixel_format = code;
    if (calls.control(descriptor, VIDIOC_ENUM_FRAMESIZES, &size) < 0) {
      break;
    }
    if (size.type != V4L2_FRMSIZE_TYPE_DISCRETE) {
      const v4l2_frmsize_stepwise& steps = size.stepwise;
      return fmt::format("{}x{} to {}x{}", steps.min_width, steps.min_height, steps.max_width,
                         steps.max_height);
    }
    text +=
        fmt::format("{}{}x{}", text.empty() ? "" : ", ", size.discrete.width, size.discrete.height);
    const double fps =
        highest_fps(calls, descriptor, code, size.discrete.width, size.discrete.height);
    text += fps > 0.0 ? fmt::format(" ({:g} fps)", fps) : "";
  }
  return text.empty() ? "sizes it does not tell" : text;
}

}  // namespace topoloc::camera

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/camera/pixel_layout.hpp"
#include "topoloc/camera/video_calls.hpp"

#include <cstdint>
#include <linux/videodev2.h>
#include <span>
#include <string>
#include <vector>

/// What an open device offers.
namespace topoloc::camera {

/// Of this device file; older drivers tell those of the whole device only.
std::uint32_t device_capabilities(const v4l2_capability& capability);

std::vector<std::uint32_t> format_codes(VideoCalls& calls, int descriptor);

/// The code by which this camera knows the layout.
std::uint32_t code_of(PixelLayout layout, std::span<const std::uint32_t> codes);

/// Sizes of a format with their highest rate: "640x480 (30 fps), 1280x720 (10 fps)".
std::string sizes_text(VideoCalls& calls, int descriptor, std::uint32_t code);

}  // namespace topoloc::camera

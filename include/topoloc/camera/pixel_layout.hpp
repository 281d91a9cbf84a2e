// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace topoloc::camera {

/// How a camera sends its pixels; those that can be used here.
enum class PixelLayout : std::uint8_t {
  kGrey,   ///< one byte a pixel
  kMjpeg,  ///< a JPEG file each
  kYuyv,   ///< 4:2:2, two bytes a pixel
};

/// V4L2's code (fourcc).
[[nodiscard]] std::uint32_t fourcc(PixelLayout layout);
[[nodiscard]] std::optional<PixelLayout> layout_of(std::uint32_t fourcc);
/// The four letters, such as "MJPG"; bytes that are no letters as dots.
[[nodiscard]] std::string fourcc_text(std::uint32_t fourcc);

/// The layout to use of those that a camera offers (codes): the one wanted, else the one that costs
/// least: grey needs nothing, JPEG fits through USB 2, YUYV is twice as much as grey. Nothing if
/// none of them will do.
[[nodiscard]] std::optional<PixelLayout> choose_layout(std::span<const std::uint32_t> offered,
                                                       std::optional<PixelLayout> wanted);

}  // namespace topoloc::camera

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace topoloc::transport {

/// Values of image_t::pixelformat (fourcc, as in libbot).
inline constexpr std::int32_t kPixelFormatGray = 1497715271;   ///< "GREY": one byte a pixel
inline constexpr std::int32_t kPixelFormatMjpeg = 1196444237;  ///< "MJPG": data is one JPEG file

inline constexpr std::int32_t kMaxImageSide_px = 16384;

enum class ImageVerdict : std::uint8_t {
  kOk,
  kTruncated,      ///< the message ends before the data that it states
  kOtherType,      ///< not an image_t (another fingerprint)
  kBadDimensions,  ///< width or height not in 1 to kMaxImageSide_px, or a row longer than its
                   ///< stride
  kBadSize,        ///< size negative, zero or (GRAY) less than the pixels need
  kUnknownFormat,  ///< pixelformat is neither GRAY nor MJPEG
};
inline constexpr std::size_t kImageVerdicts = 6;
std::string_view name(ImageVerdict verdict);

/// An image_t message, read in place.
struct ImageView {
  std::int64_t time_us = 0;
  std::int32_t width_px = 0;
  std::int32_t height_px = 0;
  std::int32_t row_stride_bytes = 0;  ///< between the starts of two rows (GRAY)
  std::int32_t pixelformat = 0;
  std::span<const std::byte> data;  ///< points into the message
};

/// Checks a received or logged image_t before anything trusts its sizes; allocates nothing.
/// (The decoder that lcm-gen makes allocates the size that the message states.) `out` is complete
/// only if kOk comes back. Metadata is not looked at.
ImageVerdict view_image(std::span<const std::byte> message, ImageView& out);

/// Gives an encoded image_t another time, in place. Of messages too short to have one nothing is
/// changed.
void set_image_time(std::span<std::byte> message, std::int64_t time_us);

}  // namespace topoloc::transport

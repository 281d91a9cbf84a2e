// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/transport/image_view.hpp"

#include "topoloc/image_t.hpp"

#include <array>

namespace topoloc::transport {
namespace {

/// LCM's wire format is big endian.
template <typename Integer>
Integer take(std::span<const std::byte>& bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i) {
    value = value << 8 | std::to_integer<std::uint64_t>(bytes[i]);
  }
  bytes = bytes.subspan(sizeof(Integer));
  return static_cast<Integer>(value);
}

/// Fingerprint, utime, width, height, row_stride, pixelformat, size.
constexpr std::size_t kFixedBytes = 8 + 8 + 5 * 4;
constexpr std::size_t kMetadataCountBytes = 4;

bool is_side(std::int32_t side_px) { return side_px >= 1 && side_px <= kMaxImageSide_px; }

}  // namespace

std::string_view name(ImageVerdict verdict) {
  constexpr std::array<std::string_view, 6> kNames = {
      "ok", "truncated", "other type", "bad dimensions", "bad size", "unknown pixel format"};
  return kNames[static_cast<std::size_t>(verdict)];
}

ImageVerdict view_image(std::span<const std::byte> message, ImageView& out) {
  if (message.size() < kFixedBytes + kMetadataCountBytes) {
    return ImageVerdict::kTruncated;
  }
  if (take<std::int64_t>(message) != topoloc::image_t::getHash()) {
    return ImageVerdict::kOtherType;
  }
  out.time_us = take<std::int64_t>(message);
  out.width_px = take<std::int32_t>(message);
  out.height_px = take<std::int32_t>(message);
  out.row_stride_bytes = take<std::int32_t>(message);
  out.pixelformat = take<std::int32_t>(message);
  const auto size = take<std::int32_t>(message);
  out.data = {};

  if (out.pixelformat != kPixelFormatGray && out.pixelformat != kPixelFormatMjpeg) {
    return ImageVerdict::kUnknownFormat;
  }
  const bool gray = out.pixelformat == kPixelFormatGray;
  if (!is_side(out.width_px) || !is_side(out.height_px) ||
      (gray && out.row_stride_bytes < out.width_px)) {
    return ImageVerdict::kBadDimensions;
  }
  if (size <= 0) {
    return ImageVerdict::kBadSize;
  }
  const auto bytes = static_cast<std::size_t>(size);
  if (bytes > message.size() - kMetadataCountBytes) {
    return ImageVerdict::kTruncated;
  }
  // The last row need not be padded to its stride.
  const std::int64_t needed =
      std::int64_t{out.row_stride_bytes} * (out.height_px - 1) + out.width_px;
  if (gray && size < needed) {
    return ImageVerdict::kBadSize;
  }
  out.data = message.first(bytes);
  return ImageVerdict::kOk;
}

void set_image_time(std::span<std::byte> message, std::int64_t time_us) {
  constexpr std::size_t kTimeOffset = 8;  // after the fingerprint
  constexpr std::size_t kTimeBytes = 8;
  if (message.size() < kTimeOffset + kTimeBytes) {
    return;
  }
  for (std::size_t i = 0; i < kTimeBytes; ++i) {
    message[kTimeOffset + i] =
        static_cast<std::byte>(static_cast<std::uint64_t>(time_us) >> (8 * (kTimeBytes - 1 - i)));
  }
}

}  // namespace topoloc::transport

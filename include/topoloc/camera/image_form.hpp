// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/image_t.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

/// The forms in which pixels come and go.
namespace topoloc::camera {

struct ImageSize {
  int width_px = 0;
  int height_px = 0;
  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};

/// Rows of `size.width_px` bytes, one after the other, out of rows that lie `stride_bytes` apart.
/// False, and `grey` empty, where `pixels` is too short for that.
bool pack_rows(std::span<const std::uint8_t> pixels, ImageSize size, std::size_t stride_bytes,
               std::vector<std::uint8_t>& grey);

/// The same for YUYV (4:2:2, two bytes a pixel): its luminance, which is the grey image.
bool yuyv_to_grey(std::span<const std::uint8_t> pixels, ImageSize size, std::size_t stride_bytes,
                  std::vector<std::uint8_t>& grey);

/// Size stated in the header of a JPEG file; nothing if that is none or is cut off before it.
std::optional<ImageSize> jpeg_size(std::span<const std::uint8_t> file);

/// Sets the fields that describe `image.data`.
void set_grey(image_t& image, ImageSize size);
void set_jpeg(image_t& image, ImageSize size);

/// How images go out.
enum class ImageForm : std::uint8_t {
  kAsTheyCome,  ///< JPEG files as they are, all else raw grey
  kGrey,
  kMjpeg,
};

/// Brings an image into that form; `jpeg_quality` (1 to 100) where it must encode. False if JPEG
/// data does not decode: the image is not to be used then.
bool convert(image_t& image, ImageForm form, int jpeg_quality);

}  // namespace topoloc::camera

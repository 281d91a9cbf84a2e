// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/camera/image_form.hpp"

#include "topoloc/transport/image_view.hpp"

#include <opencv2/imgcodecs.hpp>

namespace topoloc::camera {
namespace {

/// Bytes that an image of rows with a stride needs; the last row need not be padded.
std::size_t needed_bytes(ImageSize size, std::size_t stride_bytes, std::size_t pixel_bytes) {
  return stride_bytes * static_cast<std::size_t>(size.height_px - 1) +
         pixel_bytes * static_cast<std::size_t>(size.width_px);
}

/// Every `pixel_bytes`th byte of each row.
bool take_bytes(std::span<const std::uint8_t> pixels, ImageSize size, std::size_t stride_bytes,
                std::size_t pixel_bytes, std::vector<std::uint8_t>& grey) {
  grey.clear();
  if (size.width_px < 1 || size.height_px < 1 ||
      stride_bytes < pixel_bytes * static_cast<std::size_t>(size.width_px) ||
      pixels.size() < needed_bytes(size, stride_bytes, pixel_bytes)) {
    return false;
  }
  const auto width = static_cast<std::size_t>(size.width_px);
  const auto height = static_cast<std::size_t>(size.height_px);
  grey.resize(width * height);
  std::uint8_t* out = grey.data();
  for (std::size_t row = 0; row < height; ++row) {
    const std::uint8_t* in = pixels.data() + row * stride_bytes;
    for (std::size_t column = 0; column < width; ++column) {
      *out++ = in[column * pixel_bytes];
    }
  }
  return true;
}

}  // namespace

bool pack_rows(std::span<const std::uint8_t> pixels, ImageSize size, std::size_t stride_bytes,
               std::vector<std::uint8_t>& grey) {
  return take_bytes(pixels, size, stride_bytes, 1, grey);
}

bool yuyv_to_grey(std::span<const std::uint8_t> pixels, ImageSize size, std::size_t stride_bytes,
                  std::vector<std::uint8_t>& grey) {
  return take_bytes(pixels, size, stride_bytes, 2, grey);
}

std::optional<ImageSize> jpeg_size(std::span<const std::uint8_t> file) {
  // ITU T.81, annex B: a start of image, then segments of marker (ff xx) and length, up to the
  // frame header that states the size.
  constexpr std::uint8_t kMarker = 0xff;
  constexpr std::uint8_t kStartOfImage = 0xd8;
  constexpr std::uint8_t kStartOfScan = 0xda;
  const auto is_frame_header = [](std::uint8_t code) {
    return code >= 0xc0 && code <= 0xcf && code != 0xc4 && code != 0xc8 && code != 0xcc;
  };
  const auto word = [&](std::size_t at) { return file[at] << 8 | file[at + 1]; };
  if (file.size() < 4 || file[0] != kMarker || file[1] != kStartOfImage) {
    return std::nullopt;
  }
  std::size_t at = 2;
  while (at + 4 <= file.size()) {
    if (file[at] != kMarker) {
      return std::nullopt;
    }
    const std::uint8_t code = file[at + 1];
    if (code == kMarker) {  // fill byte
      ++at;
      continue;
    }
    if (is_frame_header(code)) {
      if (at + 9 > file.size()) {
        return std::nullopt;
      }
      const ImageSize size{.width_px = word(at + 7), .height_px = word(at + 5)};
      return size.width_px > 0 && size.height_px > 0 ? std::optional(size) : std::nullopt;
    }
    if (code == kStartOfScan) {
      return std::nullopt;
    }
    const int length = word(at + 2);
    if (length < 2) {
      return std::nullopt;
    }
    at += 2 + static_cast<std::size_t>(length);
  }
  return std::nullopt;
}

void set_grey(image_t& image, ImageSize size) {
  image.width = size.width_px;
  image.height = size.height_px;
  image.row_stride = size.width_px;
  image.pixelformat = transport::kPixelFormatGray;
  image.size = static_cast<std::int32_t>(image.data.size());
}

void set_jpeg(image_t& image, ImageSize size) {
  image.width = size.width_px;
  image.height = size.height_px;
  image.row_stride = 0;  // rows have no place in a file; libbot's programs write 0 too
  image.pixelformat = transport::kPixelFormatMjpeg;
  image.size = static_cast<std::int32_t>(image.data.size());
}

bool convert(image_t& image, ImageForm form, int jpeg_quality) {
  const bool is_jpeg = image.pixelformat == transport::kPixelFormatMjpeg;
  const ImageSize size{.width_px = image.width, .height_px = image.height};
  if (form == ImageForm::kGrey && is_jpeg) {
    cv::Mat grey;
    try {
      grey = cv::imdecode(image.data, cv::IMREAD_GRAYSCALE);
    } catch (const cv::Exception&) {
      return false;  // as any image that does not decode
    }
    if (grey.cols != size.width_px || grey.rows != size.height_px) {
      return false;
    }
    image.data.assign(grey.datastart, grey.dataend);
    set_grey(image, size);
  } else if (form == ImageForm::kMjpeg && !is_jpeg) {
    const cv::Mat grey(size.height_px, size.width_px, CV_8UC1, image.data.data());
    std::vector<std::uint8_t> file;
    cv::imencode(".jpg", grey, file, {cv::IMWRITE_JPEG_QUALITY, jpeg_quality});
    image.data = std::move(file);
    set_jpeg(image, size);
  }
  return true;
}

}  // namespace topoloc::camera

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "replay/black_image.hpp"

#include "topoloc/image_t.hpp"
#include "topoloc/transport/image_view.hpp"

#include <opencv2/imgcodecs.hpp>

namespace topoloc::replay {

std::vector<std::byte> black_image(std::span<const std::byte> message) {
  transport::ImageView view;
  transport::view_image(message, view);
  image_t image{};
  image.utime = view.time_us;
  image.width = view.width_px;
  image.height = view.height_px;
  image.row_stride = view.row_stride_bytes;
  image.pixelformat = view.pixelformat;
  if (view.pixelformat == transport::kPixelFormatMjpeg) {
    cv::imencode(".jpg", cv::Mat::zeros(view.height_px, view.width_px, CV_8UC1), image.data);
  } else {
    image.data.assign(view.data.size(), 0);
  }
  image.size = static_cast<std::int32_t>(image.data.size());
  std::vector<std::byte> bytes(static_cast<std::size_t>(image.getEncodedSize()));
  image.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace topoloc::replay

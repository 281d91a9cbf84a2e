// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/drive/image_decoding.hpp"

#include <opencv2/imgcodecs.hpp>

namespace topoloc::drive {

bool decode_grey(const transport::ImageView& image, cv::Size size, cv::Mat& grey) {
  // OpenCV's headers over foreign memory take a mutable pointer; nothing writes through it.
  auto* data = reinterpret_cast<unsigned char*>(const_cast<std::byte*>(image.data.data()));
  if (image.pixelformat == transport::kPixelFormatGray) {
    cv::Mat(size, CV_8UC1, data, static_cast<std::size_t>(image.row_stride_bytes)).copyTo(grey);
    return true;
  }
  try {
    cv::imdecode(cv::Mat(1, static_cast<int>(image.data.size()), CV_8UC1, data),
                 cv::IMREAD_GRAYSCALE, &grey);
  } catch (const cv::Exception&) {
    grey.release();  // as any image that does not decode
  }
  if (grey.size() != size) {
    grey.release();
    return false;
  }
  return true;
}

}  // namespace topoloc::drive

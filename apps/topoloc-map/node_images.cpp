// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "node_images.hpp"

#include "topoloc/map/depth_codec.hpp"
#include "topoloc/map/intensity_codec.hpp"

#include <cstring>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace topoloc::apps {
namespace {

template <typename T>
cv::Mat matrix(const std::vector<T>& pixels, int width_px, int height_px) {
  cv::Mat image(height_px, width_px, cv::DataType<T>::type);
  std::memcpy(image.data, pixels.data(), pixels.size() * sizeof(T));
  return image;
}

}  // namespace

NodeImages decode_images(const map::MapFile& map, std::size_t node) {
  const map::NodeView view = map.node(node);
  NodeImages images;
  const auto fail = [&](const std::string& why) {
    throw map::MapError(map.path().string() + ": node " + std::to_string(node) + ": " + why);
  };
  try {
    int width_px = 0;
    int height_px = 0;
    if (!view.depth_image.empty()) {
      const std::vector<float> depth_m = map::decode_depth(view.depth_image, width_px, height_px);
      images.depth_m = matrix(depth_m, width_px, height_px);
    }
    if (!view.intensity_image.empty()) {
      const std::vector<std::uint8_t> intensity =
          map::decode_intensity(view.intensity_image, width_px, height_px);
      images.intensity = matrix(intensity, width_px, height_px);
    }
  } catch (const map::MapError& error) {
    fail(error.what());
  }
  if (!view.camera_image.empty()) {
    const auto* data = reinterpret_cast<const unsigned char*>(view.camera_image.data());
    images.grey = cv::imdecode(std::vector<unsigned char>(data, data + view.camera_image.size()),
                               cv::IMREAD_GRAYSCALE);
    if (images.grey.empty()) {
      fail("camera image cannot be decoded");
    }
  }
  const PinholeCamera& camera = map.info().camera;
  for (const cv::Mat& image : {images.grey, images.depth_m, images.intensity}) {
    if (!image.empty() && (image.cols != camera.width_px || image.rows != camera.height_px)) {
      fail("an image does not have the size of the camera");
    }
  }
  return images;
}

cv::Mat fill_small_holes(const cv::Mat& image, int reach_px) {
  cv::Mat filled;
  image.convertTo(filled, CV_32F);
  for (int i = 0; i < reach_px; ++i) {
    cv::Mat known;
    cv::Mat(filled > 0.0F).convertTo(known, CV_32F, 1.0 / 255.0);
    cv::Mat sum;
    cv::Mat count;
    cv::boxFilter(filled, sum, CV_32F, {3, 3}, {-1, -1}, false, cv::BORDER_CONSTANT);
    cv::boxFilter(known, count, CV_32F, {3, 3}, {-1, -1}, false, cv::BORDER_CONSTANT);
    const cv::Mat mean = sum / cv::max(count, 1.0F);
    // Two neighbours at least: a single stray point must not grow into a blot.
    mean.copyTo(filled, (filled == 0.0F) & (count > 1.5F));
  }
  return filled;
}

}  // namespace topoloc::apps

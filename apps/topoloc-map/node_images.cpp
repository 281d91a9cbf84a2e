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

constexpr int kReach_px = 3;  ///< holes of twice this size are closed

template <typename T>
cv::Mat matrix(const std::vector<T>& pixels, int width_px, int height_px) {
  cv::Mat image(height_px, width_px, cv::DataType<T>::type);
  std::memcpy(image.data, pixels.data(), pixels.size() * sizeof(T));
  return image;
}

/// Fills holes that points surround, from their rims inwards; stray points do not grow into blots.
template <typename Estimate>
void fill(cv::Mat& image, const Estimate& estimate) {
  const cv::Mat disc =
      cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * kReach_px + 1, 2 * kReach_px + 1});
  cv::Mat surrounded;
  cv::morphologyEx(image > 0.0F, surrounded, cv::MORPH_CLOSE, disc);
  for (int i = 0; i < kReach_px; ++i) {
    estimate(image).copyTo(image, surrounded & (image == 0.0F));
  }
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

cv::Mat fill_intensity(const cv::Mat& intensity) {
  cv::Mat filled;
  intensity.convertTo(filled, CV_32F);
  fill(filled, [](const cv::Mat& image) {
    cv::Mat known;
    cv::Mat(image > 0.0F).convertTo(known, CV_32F, 1.0 / 255.0);
    cv::Mat sum;
    cv::Mat count;
    cv::boxFilter(image, sum, CV_32F, {3, 3}, {-1, -1}, false, cv::BORDER_CONSTANT);
    cv::boxFilter(known, count, CV_32F, {3, 3}, {-1, -1}, false, cv::BORDER_CONSTANT);
    return cv::Mat(sum / cv::max(count, 1.0F));
  });
  return filled;
}

cv::Mat fill_depth(const cv::Mat& depth_m) {
  constexpr float kFar_m = 1e6F;
  cv::Mat filled = depth_m.clone();
  fill(filled, [](const cv::Mat& image) {
    // The nearest: between a pole and what is behind it there is nothing.
    cv::Mat nearest = image.clone();
    nearest.setTo(kFar_m, image == 0.0F);
    cv::erode(nearest, nearest, cv::Mat::ones(3, 3, CV_8U));
    nearest.setTo(0.0F, nearest == kFar_m);
    return nearest;
  });
  return filled;
}

}  // namespace topoloc::apps

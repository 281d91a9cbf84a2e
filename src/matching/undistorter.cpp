// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/matching/undistorter.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include <opencv2/imgproc.hpp>

namespace topoloc::matching {
namespace {

// The radial polynomial folds back far outside the image: there, a ray would be drawn from a pixel
// that shows another ray. Rays whose pixel does not lead back to them are not seen.
constexpr double kRoundTripTolerance = 1e-3;  // at Z = 1: about half a pixel

bool sees(const CameraCalibration& camera, const Eigen::Vector3d& ray,
          const Eigen::Vector2d& pixel_px) {
  if (!camera.pinhole.contains(pixel_px)) {
    return false;
  }
  const auto back = camera.unproject(pixel_px);
  return back && (*back - ray).head<2>().norm() < kRoundTripTolerance * ray.norm();
}

void check_camera(const PinholeCamera& camera, const char* which) {
  if (camera.width_px <= 0 || camera.height_px <= 0 || !(camera.fx_px > 0.0) ||
      !(camera.fy_px > 0.0)) {
    throw std::invalid_argument(
        std::string("undistortion: the ") + which +
        " camera needs a positive size and focal length, found " + std::to_string(camera.width_px) +
        "x" + std::to_string(camera.height_px) + ", f " + std::to_string(camera.fx_px));
  }
}

}  // namespace

Undistorter::Undistorter(const CameraCalibration& raw, const PinholeCamera& target)
    : target_(target), raw_size_(raw.pinhole.width_px, raw.pinhole.height_px) {
  check_camera(raw.pinhole, "raw");
  check_camera(target, "target");
  shrink_ = std::max(1, static_cast<int>(raw.pinhole.fx_px / target.fx_px));
  const cv::Size size(target.width_px, target.height_px);
  cv::Mat map_x(size, CV_32FC1);
  cv::Mat map_y(size, CV_32FC1);
  seen_.create(size, CV_8UC1);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const Eigen::Vector3d ray = target.ray({u, v});
      const Eigen::Vector2d pixel = raw.project(ray);
      const bool seen = pixel.allFinite() && sees(raw, ray, pixel);
      seen_.at<std::uint8_t>(v, u) = seen ? 255 : 0;
      // In the shrunk image; pixel centres at whole numbers. Unseen: outside, so remap fills 0.
      const double offset = 0.5 * (shrink_ - 1);
      map_x.at<float>(v, u) = seen ? static_cast<float>((pixel.x() - offset) / shrink_) : -16.0F;
      map_y.at<float>(v, u) = seen ? static_cast<float>((pixel.y() - offset) / shrink_) : -16.0F;
    }
  }
  cv::convertMaps(map_x, map_y, map_fixed_, map_fraction_, CV_16SC2);
}

void Undistorter::undistort(const cv::Mat& raw, cv::Mat& out) const {
  check_raw(raw, "image");
  const cv::Mat* source = &raw;
  cv::Mat shrunk;
  if (shrink_ > 1) {
    const cv::Size size(raw.cols / shrink_, raw.rows / shrink_);
    cv::resize(raw({0, 0, size.width * shrink_, size.height * shrink_}), shrunk, size, 0, 0,
               cv::INTER_AREA);
    source = &shrunk;
  }
  cv::remap(*source, out, map_fixed_, map_fraction_, cv::INTER_LINEAR, cv::BORDER_CONSTANT, 0);
}

cv::Mat Undistorter::mask(const cv::Mat& raw_mask, int erosion_px) const {
  cv::Mat mask = seen_.clone();
  if (!raw_mask.empty()) {
    check_raw(raw_mask, "mask");
    cv::Mat usable;
    undistort(raw_mask != 0, usable);
    mask &= (usable == 255);
  }
  if (erosion_px > 0) {
    const int side = 2 * erosion_px + 1;
    cv::erode(mask, mask, cv::Mat::ones(side, side, CV_8UC1));
  }
  return mask;
}

void Undistorter::check_raw(const cv::Mat& image, const char* what) const {
  if (image.type() != CV_8UC1 || image.size() != raw_size_) {
    throw std::invalid_argument(
        std::string("undistortion: the ") + what + " is " + std::to_string(image.cols) + "x" +
        std::to_string(image.rows) + " with " + std::to_string(image.channels()) + " channels of " +
        std::to_string(8 * image.elemSize1()) + " bit, expected grey 8 bit " +
        std::to_string(raw_size_.width) + "x" + std::to_string(raw_size_.height));
  }
}

}  // namespace topoloc::matching

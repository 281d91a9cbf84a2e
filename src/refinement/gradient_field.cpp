// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/gradient_field.hpp"

#include "refinement/smooth_intensity.hpp"

#include <cmath>

#include <opencv2/imgproc.hpp>

namespace topoloc::refinement {
namespace {

cv::Mat blurred(const cv::Mat& image, double sigma_px) {
  cv::Mat out;
  cv::GaussianBlur(image, out, cv::Size(), sigma_px);
  return out;
}

/// `floor`: gradients below it are noise wherever they are; in units of the image.
GradientField orientation_field(const cv::Mat& image, const cv::Mat& valid, double floor,
                                const GradientConfig& config) {
  cv::Mat gx;
  cv::Mat gy;
  cv::Sobel(image, gx, CV_32F, 1, 0);
  cv::Sobel(image, gy, CV_32F, 0, 1);
  cv::Mat magnitude;
  cv::magnitude(gx, gy, magnitude);
  const cv::Mat usual = blurred(magnitude, config.contrast_sigma_px);
  GradientField field{cv::Mat(image.size(), CV_32FC2), valid};
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const float m = magnitude.at<float>(v, u);
      cv::Vec2f& out = field.orientation.at<cv::Vec2f>(v, u);
      out = {0.0F, 0.0F};
      if (valid.at<unsigned char>(v, u) != 0 && m > 0.0F) {
        const float weight = m / (m + usual.at<float>(v, u) + static_cast<float>(floor));
        const float c = gx.at<float>(v, u) / m;
        const float s = gy.at<float>(v, u) / m;
        out = {weight * (c * c - s * s), weight * 2.0F * c * s};
      }
    }
  }
  return field;
}

}  // namespace

GradientField camera_gradients(const cv::Mat& grey, const cv::Mat& mask,
                               const GradientConfig& config) {
  constexpr double kNoise_grey = 2.0;
  cv::Mat image;
  grey.convertTo(image, CV_32F);
  cv::Mat valid;
  const int margin = static_cast<int>(std::ceil(2.0 * config.camera_sigma_px));
  cv::erode(mask, valid, cv::Mat::ones(2 * margin + 1, 2 * margin + 1, CV_8U), cv::Point(-1, -1), 1,
            cv::BORDER_CONSTANT, cv::Scalar(0));
  return orientation_field(blurred(image, config.camera_sigma_px), valid, kNoise_grey, config);
}

GradientField intensity_gradients(const mapping::RenderedView& view, const GradientConfig& config) {
  constexpr double kNoise = 0.02;
  constexpr int kMargin_px = 3;
  const auto [mean, seen] = smooth_intensity(view, config.intensity_sigma_px);
  cv::Mat valid = blurred(seen, 2.0 * config.intensity_sigma_px) > config.min_cloud_density;
  cv::erode(valid, valid, cv::Mat::ones(2 * kMargin_px + 1, 2 * kMargin_px + 1, CV_8U));
  return orientation_field(blurred(mean, 0.7), valid, kNoise, config);
}

}  // namespace topoloc::refinement

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "topoloc/refinement/gradient_field.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

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

/// Intensity that 95 of 100 visible points do not reach: makes any unit comparable.
float bright(const mapping::RenderedView& view) {
  std::vector<float> values;
  for (std::size_t i = 0; i < view.intensity.size(); ++i) {
    if (view.point[i] != mapping::RenderedView::kHole) {
      values.push_back(view.intensity[i]);
    }
  }
  if (values.empty()) {
    return 0.0F;
  }
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 95 / 100);
  std::nth_element(values.begin(), at, values.end());
  return *at;
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
  const cv::Size size(view.camera.width_px, view.camera.height_px);
  const float scale = bright(view);
  cv::Mat seen = cv::Mat::zeros(size, CV_32F);
  cv::Mat sum = cv::Mat::zeros(size, CV_32F);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      if (!view.is_hole(u, v)) {
        seen.at<float>(v, u) = 1.0F;
        sum.at<float>(v, u) =
            scale > 0.0F ? std::clamp(view.intensity[view.index(u, v)] / scale, 0.0F, 2.0F) : 0.0F;
      }
    }
  }
  // Normalised convolution: mean of the points around, however many they are.
  const cv::Mat density = blurred(seen, config.intensity_sigma_px);
  cv::Mat mean = blurred(sum, config.intensity_sigma_px) / (density + 1e-6F);
  // The root evens out retro-reflectors and tarmac.
  cv::sqrt(cv::max(mean, 0.0), mean);
  cv::Mat valid = blurred(seen, 2.0 * config.intensity_sigma_px) > config.min_cloud_density;
  cv::erode(valid, valid, cv::Mat::ones(2 * kMargin_px + 1, 2 * kMargin_px + 1, CV_8U));
  return orientation_field(blurred(mean, 0.7), valid, kNoise, config);
}

}  // namespace topoloc::refinement

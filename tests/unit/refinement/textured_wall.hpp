// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/mapping/render.hpp"

#include "support/random_states.hpp"

#include <cstdint>

#include <opencv2/imgproc.hpp>

namespace topoloc::refinement {

/// Irregular patches of three brightnesses, CV_8UC1.
inline cv::Mat patches(const cv::Size& size, std::uint64_t seed) {
  constexpr double kPatch_px = 5.0;
  test::Random random(seed);
  cv::Mat noise(size, CV_32F);
  for (int v = 0; v < noise.rows; ++v) {
    for (int u = 0; u < noise.cols; ++u) {
      noise.at<float>(v, u) = static_cast<float>(random.normal());
    }
  }
  cv::GaussianBlur(noise, noise, cv::Size(), kPatch_px);
  cv::Mat image(size, CV_8UC1, cv::Scalar(120));
  image.setTo(40, noise < -0.025);
  image.setTo(210, noise > 0.025);
  return image;
}

/// A cloud that lies in one plane in front of the camera, a point in each pixel where `seen`
/// (CV_8UC1) is not 0; its intensities are `intensity` (CV_8UC1) times `unit`.
inline mapping::RenderedView wall_view(const cv::Mat& intensity, const cv::Mat& seen,
                                       float unit = 1.0F, float depth_m = 10.0F) {
  constexpr double kFocal_px = 200.0;
  mapping::RenderedView view;
  view.camera = {intensity.cols,
                 intensity.rows,
                 kFocal_px,
                 kFocal_px,
                 0.5 * (intensity.cols - 1),
                 0.5 * (intensity.rows - 1)};
  std::uint32_t point = 0;
  for (int v = 0; v < intensity.rows; ++v) {
    for (int u = 0; u < intensity.cols; ++u) {
      const bool hole = seen.at<unsigned char>(v, u) == 0;
      view.depth_m.push_back(hole ? 0.0F : depth_m);
      view.intensity.push_back(hole ? 0.0F
                                    : unit * static_cast<float>(intensity.at<unsigned char>(v, u)));
      view.point.push_back(hole ? mapping::RenderedView::kHole : point++);
      view.pixel_px.emplace_back(static_cast<float>(u), static_cast<float>(v));
    }
  }
  return view;
}

inline cv::Mat everywhere(const cv::Size& size) { return {size, CV_8UC1, cv::Scalar(255)}; }

/// 255 at that share of the pixels.
inline cv::Mat scattered(const cv::Size& size, double share, std::uint64_t seed) {
  test::Random random(seed);
  cv::Mat seen(size, CV_8UC1);
  for (int v = 0; v < seen.rows; ++v) {
    for (int u = 0; u < seen.cols; ++u) {
      seen.at<unsigned char>(v, u) = random.uniform() < share ? 255 : 0;
    }
  }
  return seen;
}

}  // namespace topoloc::refinement

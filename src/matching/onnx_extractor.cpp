// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "matching/onnx_extractor.hpp"

#include "matching/model_files.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace topoloc::matching {

OnnxExtractor::OnnxExtractor(const MatchingConfig& config)
    : size_(config.width_px, config.height_px),
      max_features_(config.max_features),
      model_(extractor_file(config), config.threads, config.execution_provider),
      identity_{.name = config.extractor,
                .fingerprint = model_.fingerprint(),
                .descriptor_dim = model_.output_columns("descriptors")},
      image_(model_.input("image", {1, 1, size_.height, size_.width})),
      mask_(model_.input("mask", {1, 1, size_.height, size_.width})),
      keypoints_(model_.output<float>("keypoints", {max_features_, 2})),
      scores_(model_.output<float>("scores", {max_features_})),
      descriptors_(model_.output<float>("descriptors", {max_features_, identity_.descriptor_dim})) {
  model_.require_no_other_inputs();
  std::fill(mask_.begin(), mask_.end(), 1.0F);
}

void OnnxExtractor::check_size(const cv::Mat& image, const char* what) const {
  if (image.type() != CV_8UC1 || image.size() != size_) {
    throw std::invalid_argument(identity_.name + ": the " + what + " is " +
                                std::to_string(image.cols) + "x" + std::to_string(image.rows) +
                                ", expected grey 8 bit " + std::to_string(size_.width) + "x" +
                                std::to_string(size_.height));
  }
}

void OnnxExtractor::set_mask(const cv::Mat& mask) {
  check_size(mask, "mask");
  cv::Mat input(size_, CV_32FC1, mask_.data());
  cv::Mat(mask != 0).convertTo(input, CV_32FC1, 1.0 / 255.0);
}

void OnnxExtractor::extract(const cv::Mat& undistorted_grey, FeatureSet& out) {
  check_size(undistorted_grey, "image");
  cv::Mat input(size_, CV_32FC1, image_.data());
  undistorted_grey.convertTo(input, CV_32FC1);
  model_.run();

  const auto dim = static_cast<std::size_t>(identity_.descriptor_dim);
  if (out.capacity() < max_features_ || out.descriptor_dim != identity_.descriptor_dim) {
    out = FeatureSet(max_features_, identity_.descriptor_dim);
  }
  out.width_px = size_.width;
  out.height_px = size_.height;
  out.count = 0;
  for (std::size_t i = 0; i < scores_.size(); ++i) {
    const Eigen::Vector2f pixel(keypoints_[2 * i], keypoints_[2 * i + 1]);
    const auto descriptor = descriptors_.subspan(i * dim, dim);
    // Empty slots, and what a flat image makes of them (0 / 0 when normalised).
    if (!(scores_[i] > 0.0F) || !pixel.allFinite() || !std::isfinite(descriptor.front())) {
      continue;
    }
    const auto slot = static_cast<std::size_t>(out.count++);
    out.pixels_px[slot] = pixel;
    out.scores[slot] = scores_[i];
    std::copy(descriptor.begin(), descriptor.end(),
              out.descriptors.begin() + static_cast<std::ptrdiff_t>(slot * dim));
  }
}

}  // namespace topoloc::matching

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "matching/sift_extractor.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>

namespace topoloc::matching {
namespace {

constexpr int kDescriptorDim = 128;
/// There is no model file to take a fingerprint of; to be changed where descriptors change.
constexpr std::uint64_t kFingerprint = 1;
/// Contrast of an extremum (grey from 0 to 1) from which on its score is 1.
constexpr float kFullResponse = 0.1F;

void check_size(const cv::Mat& image, cv::Size size, const char* what) {
  if (image.type() != CV_8UC1 || image.size() != size) {
    throw std::invalid_argument("sift: the " + std::string(what) + " is " +
                                std::to_string(image.cols) + "x" + std::to_string(image.rows) +
                                ", expected grey 8 bit " + std::to_string(size.width) + "x" +
                                std::to_string(size.height));
  }
}

}  // namespace

SiftExtractor::SiftExtractor(const MatchingConfig& config)
    : size_(config.width_px, config.height_px),
      max_features_(config.max_features),
      identity_{.name = kName, .fingerprint = kFingerprint, .descriptor_dim = kDescriptorDim},
      sift_(cv::SIFT::create(config.max_features)),
      mask_(size_, CV_8UC1, cv::Scalar(255)) {}

void SiftExtractor::set_mask(const cv::Mat& mask) {
  check_size(mask, size_, "mask");
  mask_ = mask.clone();
}

void SiftExtractor::extract(const cv::Mat& undistorted_grey, FeatureSet& out) {
  check_size(undistorted_grey, size_, "image");
  sift_->detectAndCompute(undistorted_grey, mask_, keypoints_, descriptors_);
  // Neither sorted nor exactly as many as asked for: a point is repeated for each orientation.
  std::vector<int> order(keypoints_.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [this](int a, int b) {
    return keypoints_[static_cast<std::size_t>(a)].response >
           keypoints_[static_cast<std::size_t>(b)].response;
  });

  if (out.capacity() < max_features_ || out.descriptor_dim != kDescriptorDim) {
    out = FeatureSet(max_features_, kDescriptorDim);
  }
  out.width_px = size_.width;
  out.height_px = size_.height;
  out.count = 0;
  for (const int i : order) {
    if (out.count == max_features_) {
      break;
    }
    const cv::KeyPoint& keypoint = keypoints_[static_cast<std::size_t>(i)];
    const cv::Mat row = descriptors_.row(i);
    const double length = cv::norm(row);
    if (!(length > 0.0)) {
      continue;
    }
    const auto slot = static_cast<std::size_t>(out.count++);
    out.pixels_px[slot] = {std::clamp(keypoint.pt.x, 0.0F, static_cast<float>(size_.width - 1)),
                           std::clamp(keypoint.pt.y, 0.0F, static_cast<float>(size_.height - 1))};
    out.scores[slot] = std::min(1.0F, keypoint.response / kFullResponse);
    for (int k = 0; k < kDescriptorDim; ++k) {
      out.descriptors[slot * kDescriptorDim + static_cast<std::size_t>(k)] =
          static_cast<float>(static_cast<double>(row.at<float>(k)) / length);
    }
  }
}

}  // namespace topoloc::matching

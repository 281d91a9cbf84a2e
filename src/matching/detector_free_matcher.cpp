// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "matching/detector_free_matcher.hpp"

#include "matching/pixel_matches.hpp"

#include <stdexcept>

namespace topoloc::matching {
namespace {

/// The file's own size; where it leaves a side open, the configured one.
cv::Size size_of_images(const OnnxModel& model, const MatchingConfig& config) {
  const OnnxModel::Shape& shape = model.input_shape("image0", 4);
  const auto side = [](std::int64_t stated, int configured) {
    return stated == OnnxModel::kAnySide ? configured : static_cast<int>(stated);
  };
  return {side(shape[3], config.width_px), side(shape[2], config.height_px)};
}

void check(const cv::Mat& image, cv::Size size, const char* what) {
  if (image.type() != CV_8UC1 || image.size() != size) {
    throw std::invalid_argument(std::string("image pair: the ") + what + " is " +
                                std::to_string(image.cols) + "x" + std::to_string(image.rows) +
                                ", expected grey 8 bit " + std::to_string(size.width) + "x" +
                                std::to_string(size.height));
  }
}

}  // namespace

DetectorFreeMatcher::Side::Side(OnnxModel& model, const std::string& suffix, cv::Size size_in)
    : size(size_in), grey(model.input("image" + suffix, {1, 1, size.height, size.width})) {
  if (model.has_input("mask" + suffix)) {
    mask = model.input("mask" + suffix, {1, 1, size.height, size.width});
  }
}

void DetectorFreeMatcher::Side::fill(const MaskedImage& image) {
  check(image.grey, size, "image");
  cv::Mat input(size, CV_32FC1, grey.data());
  image.grey.convertTo(input, CV_32FC1, 1.0 / 255.0);
  if (!image.mask.empty()) {
    check(image.mask, size, "mask");
  }
  if (!mask.empty()) {
    cv::Mat keep(size, CV_32FC1, mask.data());
    if (image.mask.empty()) {
      keep = 1.0F;
    } else {
      cv::Mat(image.mask != 0).convertTo(keep, CV_32FC1, 1.0 / 255.0);
    }
  }
}

DetectorFreeMatcher::DetectorFreeMatcher(const MatchingConfig& config,
                                         const std::filesystem::path& model)
    : model_(model, config.threads, config.execution_provider),
      min_confidence_(static_cast<float>(config.min_match_score)),
      size_(size_of_images(model_, config)),
      sides_{Side(model_, "0", size_), Side(model_, "1", size_)} {
  for (const char* keypoints : {"keypoints0", "keypoints1"}) {
    model_.expect_output(keypoints, {OnnxModel::kAnySide, 2});
  }
  model_.expect_output("confidence", {OnnxModel::kAnySide});
  model_.require_no_other_inputs();
}

void DetectorFreeMatcher::match(const MaskedImage& image0, const MaskedImage& image1,
                                std::vector<PixelMatch>& out) {
  out.clear();
  sides_[0].fill(image0);
  sides_[1].fill(image1);
  model_.run();
  const std::span<const float> points0 = model_.result("keypoints0");
  const std::span<const float> points1 = model_.result("keypoints1");
  const std::span<const float> confidence = model_.result("confidence");
  if (points0.size() != 2 * confidence.size() || points1.size() != 2 * confidence.size()) {
    throw std::runtime_error(model_.path().string() +
                             ": the outputs disagree: " + std::to_string(points0.size() / 2) +
                             " keypoints0, " + std::to_string(points1.size() / 2) +
                             " keypoints1, " + std::to_string(confidence.size()) + " confidence");
  }
  for (std::size_t i = 0; i < confidence.size(); ++i) {
    // A fixed number of slots: 0 marks those that are empty.
    if (confidence[i] > 0.0F && confidence[i] >= min_confidence_) {
      out.push_back({.pixel0_px = {points0[2 * i], points0[2 * i + 1]},
                     .pixel1_px = {points1[2 * i], points1[2 * i + 1]},
                     .confidence = confidence[i]});
    }
  }
  remove_unusable(image0, image1, out);
  sort_by_confidence(out);
}

}  // namespace topoloc::matching

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#include "matching/band_extractor.hpp"

#include "matching/model_files.hpp"
#include "matching/onnx_extractor.hpp"

#include <stdexcept>
#include <utility>

namespace topoloc::matching {

BandExtractor::BandExtractor(std::unique_ptr<FeatureExtractor> band, cv::Size whole_size)
    : band_(std::move(band)),
      whole_size_(whole_size),
      first_row_((whole_size.height - band_->input_size().height) / 2) {}

cv::Mat BandExtractor::rows_of(const cv::Mat& image) const {
  if (image.size() != whole_size_) {
    throw std::invalid_argument("band of an image: not of the configured size");
  }
  return image.rowRange(first_row_, first_row_ + band_->input_size().height);
}

void BandExtractor::set_mask(const cv::Mat& mask) { band_->set_mask(rows_of(mask)); }

void BandExtractor::extract(const cv::Mat& undistorted_grey, FeatureSet& out) {
  band_->extract(rows_of(undistorted_grey), out);
  for (int i = 0; i < out.count; ++i) {
    out.pixels_px[static_cast<std::size_t>(i)].y() += static_cast<float>(first_row_);
  }
  out.height_px = whole_size_.height;
}

std::unique_ptr<FeatureExtractor> make_band_extractor(const MatchingConfig& config) {
  const MatchingConfig band = band_of(config);
  if (!has_extractor_file(band)) {
    return nullptr;
  }
  return std::make_unique<BandExtractor>(std::make_unique<OnnxExtractor>(band),
                                         cv::Size(config.width_px, config.height_px));
}

}  // namespace topoloc::matching

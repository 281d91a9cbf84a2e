// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/matching/image_pair_matcher.hpp"

#include "matching/onnx_model.hpp"

#include <array>
#include <filesystem>

namespace topoloc::matching {

/// Runs a network that takes two images and gives pairs of pixels, as LoFTR and Patch2Pix do.
/// docs/models.md says what its inputs and outputs must be.
class DetectorFreeMatcher final : public ImagePairMatcher {
 public:
  DetectorFreeMatcher(const MatchingConfig& config, const std::filesystem::path& model);

  [[nodiscard]] cv::Size input_size() const override { return size_; }
  void match(const MaskedImage& image0, const MaskedImage& image1,
             std::vector<PixelMatch>& out) override;

 private:
  /// Inputs of one of the two images.
  struct Side {
    Side(OnnxModel& model, const std::string& suffix, cv::Size size);
    void fill(const MaskedImage& image);

    cv::Size size;
    std::span<float> grey;  ///< H x W, 0..1
    std::span<float> mask;  ///< H x W, 1 keep, 0 ignore; empty where the model has none
  };

  OnnxModel model_;
  float min_confidence_;
  cv::Size size_;
  std::array<Side, 2> sides_;
};

}  // namespace topoloc::matching

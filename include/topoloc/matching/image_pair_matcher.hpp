// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/matching/config.hpp"

#include <filesystem>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace topoloc::matching {

/// An undistorted grey image and where to look in it.
struct MaskedImage {
  cv::Mat grey;  ///< CV_8UC1, ImagePairMatcher::input_size()
  cv::Mat mask;  ///< CV_8UC1, same size, 0 = ignore; empty: look everywhere
};

/// The same point seen at a pixel of either image (pixel centres at whole numbers).
struct PixelMatch {
  Eigen::Vector2f pixel0_px;
  Eigen::Vector2f pixel1_px;
  float confidence = 0.0F;  ///< higher is surer; comparable within one matcher only
};

/// Matches two images, which need not come from one sensor, whether or not the method behind it
/// knows features. Not thread-safe: one per thread.
class ImagePairMatcher {
 public:
  virtual ~ImagePairMatcher() = default;
  /// Size that both images must have.
  [[nodiscard]] virtual cv::Size input_size() const = 0;
  /// Replaces `out` by the matches, surest first; none lies on a masked pixel of either image.
  /// Throws std::invalid_argument where an image or mask has another size or type.
  virtual void match(const MaskedImage& image0, const MaskedImage& image1,
                     std::vector<PixelMatch>& out) = 0;
};

/// Without `detector_free_model`: the feature extractor and the feature matcher that `config` names
/// ("guided" is refused: it needs a prediction). With it: that ONNX file, which takes two images
/// and gives pairs of pixels (docs/models.md says what it must look like); of `config` then hold
/// min_match_score, threads, execution_provider, and width_px and height_px where the file leaves
/// the size open.
/// Throws std::invalid_argument where `config` is out of range, std::runtime_error that names file
/// and input where a model is missing or is not what was expected.
std::unique_ptr<ImagePairMatcher> make_pair_matcher(
    const MatchingConfig& config, const std::filesystem::path& detector_free_model = {});

/// The networks behind make_pair_matcher(); throws as it does where one is missing.
std::vector<std::filesystem::path> pair_matcher_files(
    const MatchingConfig& config, const std::filesystem::path& detector_free_model = {});

}  // namespace topoloc::matching

// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/geometry/camera.hpp"

#include <opencv2/core.hpp>

namespace topoloc::matching {

/// Resamples raw camera images into an ideal pinhole camera with the same centre and axes. Where
/// the target is coarser, the raw image is averaged first.
class Undistorter {
 public:
  /// Throws std::invalid_argument where a camera has no size or no focal length.
  Undistorter(const CameraCalibration& raw, const PinholeCamera& target);

  /// `raw`: CV_8UC1 of the calibrated size (std::invalid_argument otherwise). `out` becomes
  /// CV_8UC1 of the target's size; pixels that the raw image does not show are 0.
  void undistort(const cv::Mat& raw, cv::Mat& out) const;

  /// Mask of usable target pixels (CV_8UC1, 255 usable): those that see the raw image, outside
  /// `raw_mask` (CV_8UC1 of the raw size, 0 = ignore; empty: nothing ignored), with a margin of
  /// `erosion_px` to everything ignored.
  [[nodiscard]] cv::Mat mask(const cv::Mat& raw_mask, int erosion_px) const;

  [[nodiscard]] const PinholeCamera& target() const { return target_; }

 private:
  void check_raw(const cv::Mat& image, const char* what) const;

  PinholeCamera target_;
  cv::Size raw_size_;
  /// The raw image is first averaged down by this whole factor: sampling one raw pixel in four
  /// would alias, and features on aliases do not repeat.
  int shrink_ = 1;
  cv::Mat map_fixed_;  ///< cv::remap's fixed-point maps: half the memory traffic of float ones
  cv::Mat map_fraction_;
  cv::Mat seen_;  ///< 255 where the target pixel lies in the raw image
};

}  // namespace topoloc::matching

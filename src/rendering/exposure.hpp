// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/rendering/camera_renderer.hpp"

namespace topoloc::rendering {

/// Chooses exposure time and gain from frame to frame, some tenths of a second late as real ones
/// are: at the end of a tunnel images are white or black for a while.
class ExposureControl {
 public:
  explicit ExposureControl(const CameraSpec& spec);

  /// For the next frame.
  [[nodiscard]] double exposure_s() const;
  [[nodiscard]] double gain() const;
  /// At once, as after seconds in the same light. `level(exposure x gain)`: mean of the image, 0
  /// to 1, growing with it.
  template <typename Level>
  void settle(const Level& level) {
    double low = min_s_;
    double high = max_s_;
    for (int i = 0; i < 40; ++i) {
      total_s_ = std::sqrt(low * high);
      (level(total_s_) < target_ ? low : high) = total_s_;
    }
  }
  /// Takes note of the mean of an image.
  void observe(double level);

 private:
  double min_s_;
  double longest_s_;
  double max_s_;
  double target_;
  double part_;     ///< of the way to the target from one image to the next
  double total_s_;  ///< exposure time x gain
};

}  // namespace topoloc::rendering

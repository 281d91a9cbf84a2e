// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/camera/stamps_file.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace topoloc::camera {

/// When the images of a recording were taken: at a fixed rate, or as a file of stamps says.
class ImageTimes {
 public:
  /// Throws std::invalid_argument if the rate is not positive.
  explicit ImageTimes(double fps);
  /// At least one.
  explicit ImageTimes(const std::vector<ImageStamp>& stamps);

  /// Of the image of that place since the first one; past the last stamp there is none: false.
  [[nodiscard]] bool elapsed_ns(std::size_t index, std::int64_t& elapsed_ns) const;
  /// From the first of `count` images to the first of the next lap.
  [[nodiscard]] std::int64_t lap_ns(std::size_t count) const;
  /// Recorded time of the first; 0 at a fixed rate.
  [[nodiscard]] std::int64_t first_ns() const { return first_ns_; }

 private:
  double period_ns_ = 0.0;
  std::int64_t first_ns_ = 0;
  std::vector<std::int64_t> elapsed_;  ///< empty: a fixed rate
};

}  // namespace topoloc::camera

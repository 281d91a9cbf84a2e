// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/image_t.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace topoloc::camera {

enum class Taken : std::uint8_t {
  kImage,
  kNothing,  ///< nothing yet; ask again
  kEnd,      ///< there will be no more
};

/// A line for the operator: what happened, and what is done about it.
using Report = std::function<void(const std::string&)>;

/// Where images come from: a camera, or files that are played in real time.
class ImageSource {
 public:
  virtual ~ImageSource() = default;

  /// Waits for some 50 ms at most. The image is complete but for what does not change its meaning
  /// (metadata): utime is mid-exposure in Unix microseconds, data is GRAY without padding or one
  /// JPEG file. `image` is filled anew; its memory is used again.
  virtual Taken next(image_t& image) = 0;

  /// Everything that did not become an image, since the start, by name.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::uint64_t>> losses() const = 0;
};

}  // namespace topoloc::camera

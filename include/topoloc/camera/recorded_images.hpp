// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/image_t.hpp"

#include <cstdint>
#include <string>

namespace topoloc::camera {

enum class Read : std::uint8_t { kImage, kUnreadable, kEnd };

/// Images in files, in their order and without times.
class RecordedImages {
 public:
  virtual ~RecordedImages() = default;

  /// All of `image` but its time, its metadata empty. An image that cannot be read keeps its place
  /// in the count.
  virtual Read next(image_t& image) = 0;
  virtual void rewind() = 0;
  /// What next() read last, for messages.
  [[nodiscard]] virtual std::string place() const = 0;
};

}  // namespace topoloc::camera

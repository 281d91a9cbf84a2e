// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/camera/recorded_images.hpp"

#include <cstddef>
#include <filesystem>
#include <string_view>
#include <vector>

namespace topoloc::camera {

/// Order of file names in which numbers count as numbers: img2 before img10.
[[nodiscard]] bool name_precedes(std::string_view a, std::string_view b);

/// The images of a folder (.jpg, .jpeg, .png, .pgm, .bmp, .tif, .tiff) in that order. Throws
/// std::runtime_error, naming the folder, if it cannot be read or has none.
std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder);

/// Image files, one after the other: JPEG as they are, others as grey.
class FolderImages final : public RecordedImages {
 public:
  explicit FolderImages(std::vector<std::filesystem::path> files) : files_(std::move(files)) {}

  Read next(image_t& image) override;
  void rewind() override { next_ = 0; }
  [[nodiscard]] std::string place() const override;

 private:
  std::vector<std::filesystem::path> files_;
  std::size_t next_ = 0;
};

}  // namespace topoloc::camera

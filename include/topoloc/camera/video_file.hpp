// SPDX-License-Identifier: Apache-2.0
// SPDX-FileCopyrightText: 2026 The topoloc authors
#pragma once

#include "topoloc/camera/recorded_images.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>

namespace topoloc::camera {

/// Frames of a video file, as grey.
class VideoImages final : public RecordedImages {
 public:
  /// Throws std::runtime_error, naming the file, if that is no video that can be read here.
  explicit VideoImages(std::filesystem::path file);
  ~VideoImages() override;

  /// As stated in the file; 0 if it does not say.
  [[nodiscard]] double fps() const;

  Read next(image_t& image) override;
  void rewind() override;
  [[nodiscard]] std::string place() const override;

 private:
  struct Decoder;
  void open();

  std::filesystem::path file_;
  std::unique_ptr<Decoder> decoder_;
  std::uint64_t frame_ = 0;
};

}  // namespace topoloc::camera
